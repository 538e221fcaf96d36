"""`run --job`, and what `rerun` recalls, as a user types them."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from simrecon import cli, evidence, job, resources, results
from tests.support.runs import person, seen, squat

BETAS = "0.4,-0.8"


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short squat, also its 3D estimate and its 2D landmarks in files of their own, and a hasty plan."""
    folder = tmp_path_factory.mktemp("inputs")
    body = person()
    clip = seen(body, squat(body, np.linspace(0.0, 0.3, 12)))
    evidence.write(folder / "both.npz", clip)
    evidence.write(folder / "two.npz", replace(clip, joint_names=(), joints_m=np.zeros((12, 0, 3))))
    empty = np.zeros((12, 0, 2))
    evidence.write(
        folder / "three.npz",
        replace(clip, keypoint_names=(), keypoints_px=empty, scores=empty[..., 0], camera=None),
    )
    plan = (resources.folder("windows") / "quick.toml").read_text(encoding="utf-8")
    plan = re.sub(r"generations = \d+", "generations = 2", plan)
    (folder / "plan.toml").write_text(
        re.sub(r"descent_steps = \d+", "descent_steps = 0", plan), encoding="utf-8"
    )
    return folder


@pytest.fixture(scope="module")
def finished(inputs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("out") / "first"
    words = ["--keypoints", str(inputs / "two.npz")]
    words += ["--plan", str(inputs / "plan.toml"), "--betas", BETAS, "--height-m", "1.7", "--threads", "1"]
    assert cli.main(["run", str(inputs / "three.npz"), "-o", str(target), *words]) == 0
    return target


@pytest.fixture(scope="module")
def again(finished: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("out") / "again"
    assert cli.main(["rerun", str(finished), "-o", str(target), "--seed", "3"]) == 0
    return target


def test_rerun_recalls_what_is_not_given_again(finished: Path, again: Path) -> None:
    before, after = job.read(finished / "job.toml"), job.read(again / "job.toml")
    assert (before.seed, after.seed) == (0, 3)
    assert after.reading == before.reading
    assert after.person.betas == before.person.betas == (0.4, -0.8)
    assert after.person.height_m == before.person.height_m == 1.7
    first, second = (json.loads((place / "report.json").read_text()) for place in (finished, again))
    assert second["person"]["betas"] == first["person"]["betas"]
    assert second["metrics"]["mpjpe_2d_px"] is not None  # the landmarks of the second file


@pytest.mark.parametrize("source", ["world", "mocap"])
def test_rerun_fits_the_same_body_where_size_and_floor_are_not_known(
    inputs: Path, tmp_path: Path, source: str
) -> None:
    """The floor of motion capture is laid under the feet, here at 5 cm."""
    clip = replace(evidence.read(inputs / "both.npz"), height_m=None, mass_kg=None)
    raised = replace(clip, joints_m=clip.joints_m + np.array([0.0, 0.0, 0.05]))
    evidence.write(tmp_path / "clip.npz", raised if source == "mocap" else clip)
    first, again = tmp_path / "first", tmp_path / "again"
    words = ["--plan", str(inputs / "plan.toml"), "--threads", "1", "--trust", source]
    words += ["--ignore", "keypoints"] if source == "mocap" else []
    assert cli.main(["run", str(tmp_path / "clip.npz"), "-o", str(first), *words]) == 0
    assert cli.main(["rerun", str(first), "-o", str(again)]) == 0
    assert (results.open_result(first).scene.ground.height_m > 0.03) == (source == "mocap")
    before, after = job.read(first / "job.toml"), job.read(again / "job.toml")
    assert (after.person, after.scene) == (before.person, before.scene)
    for file in ("model.xml", "scene.toml"):
        assert (again / file).read_bytes() == (first / file).read_bytes()


def test_rerun_refuses_landmarks_that_have_changed(
    finished: Path, inputs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = inputs / "two.npz"
    kept = path.read_bytes()
    try:
        changed = evidence.read(path)
        evidence.write(path, replace(changed, keypoints_px=changed.keypoints_px + 1.0))
        assert cli.main(["rerun", str(finished), "-o", str(tmp_path / "out")]) == 2
    finally:
        path.write_bytes(kept)
    message = capsys.readouterr().err
    assert "two.npz" in message
    assert "\n" not in message.strip()
    assert not (tmp_path / "out").exists()


@pytest.fixture(scope="module")
def retargeted(finished: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("out") / "other"
    assert cli.main(["retarget", str(finished), "-o", str(target), "--height-m", "1.6"]) == 0
    return target


@pytest.mark.parametrize("name", ["finished", "again", "retargeted"])
def test_a_job_repeats_its_run_to_the_same_bits(
    name: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    first: Path = request.getfixturevalue(name)
    assert cli.main(["run", "--job", str(first / "job.toml"), "-o", str(tmp_path / "copy")]) == 0
    for file in ("motion.npz", "model.xml"):
        assert (tmp_path / "copy" / file).read_bytes() == (first / file).read_bytes()


def test_a_result_finds_the_mesh_of_its_scene_where_it_was(
    inputs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    room, out = tmp_path / "room", tmp_path / "out"
    (room / "meshes").mkdir(parents=True)
    rock = room / "meshes" / "rock.stl"
    trimesh.creation.box((0.4, 0.4, 0.4)).export(rock)
    item = '[[item]]\nname = "rock"\nkind = "mesh"\nposition_m = [2.0, 0, 0]\nfile = "meshes/rock.stl"\n'
    (room / "room.toml").write_text(item, encoding="utf-8")
    words = ["run", str(inputs / "both.npz"), "--plan", str(inputs / "plan.toml"), "--threads", "1"]
    assert cli.main([*words, "-o", str(out), "--scene", str(room / "room.toml")]) == 0
    before = results.open_result(out)
    assert before.scene.folder == str(room)
    again = [
        ["rerun", str(out)],
        ["rerun", str(out), "--scene", str(out / "scene.toml")],
        ["retarget", str(out), "--height-m", "1.6"],
        ["run", "--job", str(out / "job.toml")],
    ]
    for number, more in enumerate(again):
        assert cli.main([*more, "-o", str(tmp_path / f"again{number}")]) == 0
        result = results.open_result(tmp_path / f"again{number}")
        assert result.scene == before.scene
        assert str(rock) in result.job.sha256
    trimesh.creation.box((0.4, 0.4, 0.5)).export(rock)
    capsys.readouterr()
    for more in (again[0], *again[2:]):
        assert cli.main([*more, "-o", str(tmp_path / "none")]) == 2
        assert f"{rock}: its sha256 is not the one" in capsys.readouterr().err
    rock.unlink()
    for more in again:
        assert cli.main([*more, "-o", str(tmp_path / "none")]) == 2
        said = capsys.readouterr().err.strip()
        assert f"file 'meshes/rock.stl': no such file in {room}" in said
        assert "\n" not in said
