"""What `simrecon rerun` asks for, without doing it."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import pytest

from simrecon import cli, results, running
from simrecon import scene as scenes
from simrecon.cli import rerun
from simrecon.cli import run as run_command
from simrecon.engines import warm_start
from simrecon.errors import InputError
from simrecon.job import Job, Person, Reading, request
from simrecon.pipeline import Reconstruction
from simrecon.types import Ground, Scene
from tests.support import video_files
from tests.support.runs import job_of


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[Job]:
    """The jobs that would be executed."""
    jobs: list[Job] = []

    def execute(job: Job, _: argparse.Namespace) -> int:
        jobs.append(job)
        return 0

    for command in (rerun, run_command):
        monkeypatch.setattr(command, "execute", execute)
    return jobs


def _words(command: str, out: Path) -> list[str]:
    """What asks for a result again."""
    again = ["-o", str(out.with_name("again"))]
    return (["rerun", str(out)] if command == "rerun" else ["run", "--job", str(out / "job.toml")]) + again


@pytest.mark.parametrize("command", ["run", "rerun"])
def test_another_reading_of_a_video_finds_its_landmarks_anew(
    command: str, run: Reconstruction, tmp_path: Path, asked: list[Job]
) -> None:
    video, kept = tmp_path / "clip.mp4", tmp_path / "out.evidence.npz"
    video.touch()
    kept.touch()
    out = tmp_path / "out"
    results.write(job_of(out, input=str(video), detected=str(kept)), run)
    for more in (
        *([], ["--ignore", "joints"], ["--trust", "camera"]),
        *(["--fov", "40"], ["--person", "1"], ["--model", "lite"]),
    ):
        cli.main([*_words(command, out), *more])
    assert [job.detected for job in asked] == [str(kept)] * 3 + [None] * 3
    assert asked[3].reading.fov_deg == 40.0


def test_the_same_reading_keeps_the_landmarks_unless_it_names_a_file(
    run: Reconstruction, tmp_path: Path, asked: list[Job]
) -> None:
    out, reading = tmp_path / "out", Reading(camera="lens.toml", person_at_px=(320.0, 240.0))
    results.write(job_of(out, reading=reading, detected="kept.npz"), run)
    camera = str(Path("lens.toml").resolve())
    for more in (["--person-at", "320,240"], ["--camera", camera]):
        cli.main([*_words("run", out), *more])
    assert asked[0].detected == str(Path("kept.npz").resolve())
    assert (asked[1].reading.camera, asked[1].detected) == (camera, None)


def test_a_video_that_was_moved_is_named_with_input(
    run: Reconstruction, tmp_path: Path, asked: list[Job], capsys: pytest.CaptureFixture[str]
) -> None:
    video = video_files.write(tmp_path / "clip.mp4", [video_files.scene([], (640, 480))] * 10)
    kept, out, place = tmp_path / "out.evidence.npz", tmp_path / "out", tmp_path / "films" / "clip.mp4"
    kept.write_bytes(b"landmarks")
    job = job_of(out, input=str(video), detected=str(kept))
    results.write(replace(job, sha256=request.hashes(job)), run)
    place.parent.mkdir()
    video.rename(place)
    words = ["rerun", str(out), "-o", str(tmp_path / "again")]
    assert cli.main(words) == 2
    assert f"{video}: the evidence of {out} is not there; --input says" in capsys.readouterr().err
    cli.main([*words, "--input", str(place)])
    cli.main([*words, "--input", str(place), "--fov", "40"])
    moved, anew = asked
    assert (moved.input, moved.detected, request.changed(moved)) == (str(place), str(kept), ())
    assert (anew.input, anew.detected) == (str(place), None)
    place.write_bytes(place.read_bytes() + b" ")
    assert request.changed(moved) == (str(place),)
    kept.unlink()
    cli.main([*words, "--input", str(place)])
    assert asked[2].detected is None


@pytest.mark.parametrize("command", ["run", "rerun"])
def test_files_that_are_not_there_are_refused(
    command: str, run: Reconstruction, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    video, kept, out = tmp_path / "clip.mp4", tmp_path / "out.evidence.npz", tmp_path / "out"
    video.touch()
    kept.touch()
    results.write(job_of(out, input=str(video), detected=str(kept)), run)
    for more in (["--keypoints", "none.json"], ["--camera", "none.toml"], ["--body-model", "none.npz"]):
        assert cli.main([*_words(command, out), *more]) == 2
        assert f"{more[1]}: cannot be read (there is no such file)" in capsys.readouterr().err


def test_a_retargeting_refuses_what_is_said_of_evidence(run: Reconstruction, tmp_path: Path) -> None:
    results.write(job_of(tmp_path / "first"), run)
    reading = Reading(fov_deg=50.0, up="y")
    asked = job_of(tmp_path / "out", input=str(tmp_path / "first"), retarget=True, reading=reading)
    with pytest.raises(InputError, match="found --up, --fov for a result that is retargeted"):
        running.run(asked)


def test_a_stature_that_was_estimated_is_not_taken_for_given(
    run: Reconstruction, tmp_path: Path, asked: list[Job]
) -> None:
    out = tmp_path / "out"
    unknown = replace(run, evidence=replace(run.evidence, height_m=None, mass_kg=None))
    results.write(job_of(out, input=str(out / "motion.npz")), unknown)
    for words in ([], ["--height-m", "1.8"]):
        cli.main(["rerun", str(out), "-o", str(tmp_path / "again"), *words])
    assert [job.person for job in asked] == [Person(), Person(height_m=1.8)]


@pytest.mark.parametrize(("height_m", "recalled_m"), [(0.04, 0.0), (0.3, 0.3)])
def test_a_floor_that_was_estimated_is_not_taken_for_given(
    run: Reconstruction, tmp_path: Path, asked: list[Job], height_m: float, recalled_m: float
) -> None:
    """A floor at 0.04 m, of motion capture, which the job does not know; unless the file was edited."""
    out = tmp_path / "out"
    scene, measured = Scene(Ground(0.04)), replace(run.evidence, trust="mocap")
    changed = replace(run, fit=replace(run.fit, scene=scene), evidence=measured)
    results.write(job_of(out, input=str(out / "motion.npz")), changed)
    scenes.write(Scene(Ground(height_m)), out / "scene.toml")
    cli.main(["rerun", str(out), "-o", str(tmp_path / "again")])
    assert asked[0].scene.ground.height_m == recalled_m


@pytest.mark.parametrize("command", ["run", "rerun"])
def test_a_motion_does_not_start_another_part_of_the_clip(
    command: str,
    run: Reconstruction,
    tmp_path: Path,
    asked: list[Job],
    capsys: pytest.CaptureFixture[str],
) -> None:
    first, out = tmp_path / "first", tmp_path / "out"
    results.write(job_of(first), run)
    results.write(job_of(out, input=str(out / "motion.npz"), start=str(first / "motion.npz")), run)
    for words in (["--to", "0.2"], ["--from", "0.1"]):
        cli.main([*_words(command, out), *words])
    start = str(out / ("motion.npz" if command == "rerun" else "start.npz"))
    assert [job.start for job in asked] == [start, None]
    assert "another --from than before: begins with the kinematic fit" in capsys.readouterr().err
    later = replace(run.motion, times_s=run.motion.times_s + 0.1)
    with pytest.raises(InputError, match=r"begins at 0.1 s; valid: one that begins with the clip, at 0 s"):
        warm_start.check_beginning(later, 1 / 30, run.motion.times_s)


@pytest.mark.parametrize("command", ["run", "rerun"])
def test_a_file_that_is_named_again_is_taken_as_it_is(
    command: str, run: Reconstruction, tmp_path: Path, asked: list[Job]
) -> None:
    clip, points, others = (tmp_path / f"{name}.npz" for name in ("clip", "points", "others"))
    for path in (clip, points, others):
        path.write_text(path.name, encoding="utf-8")
    out = tmp_path / "out"
    job = job_of(out, input=str(clip), reading=Reading(keypoints=str(points)))
    results.write(replace(job, sha256=request.hashes(job)), run)
    points.write_text("changed", encoding="utf-8")
    for more in ([], ["--keypoints", str(others)], ["--keypoints", str(points)]):
        cli.main([*_words(command, out), *more])
    same, other, again = asked
    assert request.changed(same) == (str(points),)
    assert (other.reading.keypoints, request.changed(other)) == (str(others), ())
    assert (again.reading.keypoints, request.changed(again)) == (str(points), ())
