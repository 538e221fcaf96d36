"""`simrecon scene` and `simrecon rerun` as a user types them."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from simrecon import cli, evidence, kinematics, pipeline, resources, results, running, softfloor
from simrecon import plan as plans
from simrecon import scene as scenes
from simrecon.cli import observing, scene_motion
from simrecon.errors import InputError
from simrecon.types import Evidence, Ground, Motion, Scene

FIRST_LINE = "ground           height_m 0.0, friction 0.9"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "room.toml"
    assert cli.main(["scene", "new", str(path)]) == 0
    return path


def run(action: str, file: Path, *words: str) -> int:
    return cli.main(["scene", action, str(file), *words])


def test_a_scene_is_made_and_edited(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert scenes.read(file) == Scene(folder=str(file.parent))
    assert run("add", file, "chair", "arms=true", "position_m=-0.5,0.7,0", "name=seat") == 0
    assert run("add", file, "box", "size_m=[0.4, 0.4, 0.2]", "mass_kg=3") == 0
    assert run("add", file, "box", "size_m=1,1,1") == 0
    first, second, third = scenes.read(file).items
    assert (first.name, first.kind, first.position_m) == ("seat", "chair", (-0.5, 0.7, 0.0))
    assert first.parameters["arms"] is True
    assert first.parameters["seat_height_m"] == 0.45
    assert (second.name, second.mass_kg, third.name) == ("box", 3.0, "box_2")

    assert run("set", file, "seat", "seat_height_m=0.5", "back=false", "friction=0.4") == 0
    assert run("set", file, "ground", "stiffness_Npm=2e4", "damping_Nspm=300", "height_m=-0.1") == 0
    assert run("move", file, "seat", "by=0.1,0,0", "turn=0.5") == 0
    assert run("move", file, "box", "to=1,2,3") == 0
    assert run("remove", file, "box_2") == 0
    scene = scenes.read(file)
    seat, box = scene.items
    assert seat.parameters["seat_height_m"] == 0.5
    assert seat.parameters["back"] is False
    assert (seat.friction.sliding, seat.yaw_rad) == (0.4, 0.5)
    np.testing.assert_allclose(seat.position_m, [-0.4, 0.7, 0.0])
    assert box.position_m == (1.0, 2.0, 3.0)
    assert scene.ground == Ground(-0.1, stiffness_Npm=2e4, damping_Nspm=300.0)
    capsys.readouterr()
    assert run("set", file, "seat", "seat_height_m=", "friction=") == 0
    assert scenes.read(file).items[0].parameters["seat_height_m"] == 0.45
    assert "seat             chair at (-0.4, 0.7, 0) m, turned 0.5 rad" in capsys.readouterr().out


def test_comments_and_order_stay(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    file.write_text(f"# the gym\n{text}# worn\n", encoding="utf-8")
    assert run("add", file, "chair", "name=seat") == 0
    assert run("set", file, "ground", "height_m=0.1") == 0
    assert run("move", file, "seat", "by=0.5,0,0") == 0
    changed = file.read_text(encoding="utf-8")
    assert changed.startswith("# the gym\n[ground]\nheight_m = 0.1\nfriction = 0.9\n# worn\n\n[[item]]\n")
    assert "position_m = [0.5, 0.0, 0.0]" in changed


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["add", "{}", "chiar"], "'chiar' is unknown, did you mean 'chair'?"),
        (["add", "{}", "box"], "lacks the key 'size_m'"),
        (["add", "{}", "box", "size_m=-1,1,1"], "size_m must be a list of three numbers above 0"),
        (["add", "{}", "wall", "mass_kg=3"], "a wall cannot be moved"),
        (["add", "{}", "chair", "seat_hight_m=1"], "did you mean 'seat_height_m'?"),
        (["set", "{}", "sofa", "yaw_rad=1"], "there is no item 'sofa'; there: bench"),
        (["set", "{}", "bench", "yaw_rad"], "found 'yaw_rad'; valid: KEY=VALUE"),
        (["set", "{}", "bench", "seat_height_m=low"], "seat_height_m must be a number"),
        (["set", "{}", "ground", "stiffness_Npm=2e4"], "needs damping_Nspm"),
        (["move", "{}", "bench", "up=1"], "unknown 'up'; valid: to, by, turn"),
        (["move", "{}", "bench", "to=1,2"], "to must be a list of three numbers"),
        (["remove", "{}", "bnch"], "did you mean 'bench'?"),
        (["new", "{}"], "exists already"),
        (["show", "{}", "-o", "x.jpg"], "valid: a name that ends in .png"),
        (["check", "none.toml"], "none.toml: cannot read"),
        (["suggest", "none.npz"], "none.npz"),
    ],
)
def test_mistakes_are_one_line_and_change_nothing(
    file: Path, words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("add", file, "chair", "name=bench") == 0
    before = file.read_text(encoding="utf-8")
    capsys.readouterr()
    assert cli.main(["scene", *(word.format(file) for word in words)]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert said in err
    assert file.read_text(encoding="utf-8") == before


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Half a second of the demo."""
    given = evidence.read(Path(cli.__file__).parents[1] / "example" / "beam.npz")
    path = tmp_path_factory.mktemp("clip") / "clip.npz"
    evidence.write(path, evidence.cut(given, slice(0, 16)))
    return path


def test_show_draws_scene_motion_and_camera(file: Path, clip: Path, tmp_path: Path) -> None:
    run("add", file, "stairs", "position_m=0,1,0")
    assert run("show", file) == 0
    alone = cv2.imread(str(file.with_suffix(".png")))
    assert alone is not None
    assert alone.shape == (720, 960, 3)
    both = tmp_path / "both.png"
    assert run("show", file, str(clip), "-o", str(both)) == 0
    image = cv2.imread(str(both))
    assert image is not None
    assert image.shape[1] > 1900
    orange = (np.abs(image.astype(int) - [48, 134, 240]).sum(axis=-1) < 60).mean(
        axis=0
    )  # left limbs, by column
    assert orange[:960].any()
    assert orange[960:].any()


def test_check_tells_what_the_motion_goes_through(
    file: Path, clip: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    fit = kinematics.fit(evidence.resample(evidence.read(clip))[0], Scene(), plans.read("quick").kinematics)
    monkeypatch.setattr(kinematics, "fit", lambda *_: fit)
    x, y = fit.qpos[0, :2]
    run("add", file, "box", "size_m=3,3,0.05", f"position_m={x},{y},0", "name=plate")
    capsys.readouterr()
    assert run("check", file, str(clip)) == 0
    out = capsys.readouterr().out
    assert re.search(r"more than 5 mm deep in \d of 2 \(the ground and 1 item\)$", out, flags=re.M)
    plate = next(line for line in out.splitlines() if line.startswith("plate") and " mm at " in line)
    assert "_foot" in plate
    assert 30 <= float(plate.split()[1]) <= 90
    run("set", file, "plate", "size_m=3,3,0.5")
    capsys.readouterr()
    assert run("check", file, str(clip)) == 2
    assert "'plate' goes" in capsys.readouterr().err


def test_suggest_accepts_into_a_file(clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "new.toml"
    assert cli.main(["scene", "suggest", str(clip), "--height-m", "1.66", "-o", str(target)]) == 0
    out = capsys.readouterr().out
    found = scenes.read(target)
    assert len(found.items) == out.count("[[item]]")
    assert cli.main(["scene", "suggest", str(clip)]) == 0
    assert "only what is higher than 0.25 m can be found; --height-m helps" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("deep", "items", "words"),
    [
        (0, 0, "nowhere more than 5 mm deep in the ground"),
        (0, 3, "nowhere more than 5 mm deep in the ground and 3 items"),
        (1, 0, "more than 5 mm deep in the ground"),
        (1, 3, "more than 5 mm deep in 1 of 4 (the ground and 3 items)"),
    ],
)
def test_what_a_motion_goes_through_is_counted(deep: int, items: int, words: str) -> None:
    assert scene_motion._found(deep, items) == words


def test_a_scene_looks_at_the_input_as_a_run_does(
    clip: Path, file: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[Evidence, Any]] = []

    def fit(seen: Evidence, *rest: Any) -> None:
        asked.append((seen, rest[-1]))
        raise InputError("enough")

    monkeypatch.setattr(kinematics, "fit", fit)
    monkeypatch.setattr(kinematics, "fit_to_stature", fit)
    said = [str(clip), "--fps", "30", "--fov", "40", "--height-m", "1.7", "--betas", "-1"]
    for words in (["suggest", *said], ["show", str(file), *said], ["check", str(file), *said]):
        assert cli.main(["scene", *words]) == 2
        assert "read as simrecon evidence: 30 Hz as given; lens: --fov 40" in capsys.readouterr().err
    for seen, shape in asked:
        assert (seen.height_m, shape.betas[0]) == (1.7, -1.0)
        assert float(np.diff(seen.times_s).mean()) == pytest.approx(1 / 30)
    assert len(asked) == 3
    assert run("show", file, "--fov", "40") == 2
    assert "--fov: found no EVIDENCE" in capsys.readouterr().err
    assert run("check", file, str(clip), "--person", "2") == 2
    assert "--person: found '2'" in capsys.readouterr().err


@pytest.fixture(scope="module")
def finished(clip: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("out") / "result"
    assert cli.main(["run", str(clip), "-o", str(target), "--plan", "quick", "--threads", "1"]) == 0
    return target


def test_scenes_look_at_what_a_result_was_made_from(
    finished: Path, file: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Evidence] = []

    def fit(seen: Evidence, *_: Any) -> None:
        asked.append(seen)
        raise InputError("enough")

    monkeypatch.setattr(kinematics, "fit", fit)
    monkeypatch.setattr(kinematics, "fit_to_stature", fit)
    result, room = str(finished), str(file)
    for words in (["suggest", result], ["show", room, result], ["check", room, result]):
        assert cli.main(["scene", *words, "--height-m", "1.7"]) == 2
        assert "enough" in capsys.readouterr().err
    assert [(len(seen.times_s), seen.height_m) for seen in asked] == [(16, 1.7)] * 3


def test_a_video_s_landmarks_are_those_beside_its_result(finished: Path, clip: Path, tmp_path: Path) -> None:
    parsed = cli._parser().parse_args(["scene", "suggest", "x", "--trust", "world"])
    result = shutil.copytree(finished, tmp_path / "out")
    text = (result / "job.toml").read_text(encoding="utf-8")
    kept = f'input = "/nowhere/clip.mp4"\ndetected = "{clip}"'
    (result / "job.toml").write_text(re.sub(r"(?m)^input = .*$", kept, text), encoding="utf-8")
    asked = observing.job(parsed, str(result))
    assert (asked.input, asked.detected, asked.reading.trust) == ("/nowhere/clip.mp4", str(clip), "world")
    parsed = cli._parser().parse_args(["scene", "suggest", "x", "--fov", "50"])
    assert observing.job(parsed, str(result)).detected is None  # to be looked for anew
    clip_lost = kept.replace(str(clip), "/nowhere/out.evidence.npz")
    (result / "job.toml").write_text(re.sub(r"(?m)^input = .*$", clip_lost, text), encoding="utf-8")
    with pytest.raises(InputError, match="is not there, from which"):
        observing.job(parsed, str(result))


def test_rerun_starts_from_the_finished_motion(
    finished: Path, clip: Path, file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = results.read_motion(finished)
    seen: list[Motion | None] = []

    def watched(*words: Any) -> Any:
        seen.append(words[3].start)
        return pipeline.reconstruct(*words)

    run("set", file, "ground", "friction=0.8")
    hasty = (resources.folder("windows") / "quick.toml").read_text(encoding="utf-8")
    hasty = re.sub(r"generations = \d+", "generations = 2", hasty)
    hasty = re.sub(r"descent_steps = \d+", "descent_steps = 0", hasty)
    (tmp_path / "hasty.toml").write_text(hasty, encoding="utf-8")
    settings = ["--scene", str(file), "--threads", "1", "--plan", str(tmp_path / "hasty.toml")]
    anew, target = tmp_path / "anew", tmp_path / "again"
    assert cli.main(["run", str(clip), "-o", str(anew), *settings]) == 0
    monkeypatch.setattr(running, "reconstruct", watched)
    assert cli.main(["rerun", str(finished), "-o", str(target), *settings]) == 0
    assert seen[0] is not None
    np.testing.assert_array_equal(seen[0].ctrl, before.ctrl)
    first, zero, second = (
        json.loads((place / "report.json").read_text()) for place in (finished, anew, target)
    )
    assert second["person"]["height_m"] == pytest.approx(first["person"]["height_m"], rel=0.02)
    mean = [np.mean([w["loss"] for w in said["windows"]]) for said in (zero, second)]
    assert mean[1] < mean[0]
    assert scenes.read(target / "scene.toml").ground.friction.sliding == 0.8


def test_rerun_needs_its_evidence(
    finished: Path, clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "other.npz"
    evidence.write(other, replace(evidence.read(clip), mass_kg=70.0))
    for words, said in (
        (["--input", str(other)], "its sha256 is not the one"),
        (["--input", "none.npz"], "--input says where it is"),
    ):
        assert cli.main(["rerun", str(finished), "-o", str(tmp_path / "out"), *words]) == 2
        assert said in capsys.readouterr().err
    assert cli.main(["rerun", str(tmp_path), "-o", str(tmp_path / "out")]) == 2
    assert not (tmp_path / "out").exists()


def test_rerun_replaces_nothing_unless_told_where_to_write(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = {path: path.read_bytes() for path in finished.iterdir()}
    assert cli.main(["rerun", str(finished), "--plan", "quick"]) == 2
    assert "rerun: found no -o; valid: -o OUT2" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in finished.iterdir()} == before


def test_a_fitted_floor_is_used_and_reported(
    clip: Path, file: Path, finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    motion = results.read_motion(finished)
    trials = (softfloor.Trial(1e4, 200.0, 5.0), softfloor.Trial(2e4, 300.0, 4.0))
    ground = Ground(stiffness_Npm=2e4, damping_Nspm=300.0)

    def calibrated(_: object, scene: Scene, *__: object) -> softfloor.Calibration:
        assert scene.ground.calibrate
        return softfloor.Calibration(ground, trials, motion, False)

    monkeypatch.setattr(softfloor, "calibrate", calibrated)
    assert run("set", file, "ground", "stiffness_Npm=fit") == 0
    target = tmp_path / "soft"
    words = ["--scene", str(file), "--plan", "quick", "--threads", "1"]
    assert cli.main(["run", str(clip), "-o", str(target), *words]) == 0
    said = json.loads((target / "report.json").read_text())["soft_floor"]
    assert said["stiffness_Npm"] == 2e4
    assert [trial["loss"] for trial in said["trials"]] == [5.0, 4.0]
    assert scenes.read(target / "scene.toml").ground == ground
    found = results.read_motion(target)
    assert found.qpos.shape[1] == 72
    assert np.abs(found.qpos[:, 71]).max() > 0.005
