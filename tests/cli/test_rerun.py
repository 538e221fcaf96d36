"""What `simrecon rerun` asks for, without doing it."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import pytest

from simrecon import cli, results
from simrecon import scene as scenes
from simrecon.cli import rerun
from simrecon.cli import run as run_command
from simrecon.engines import warm_start
from simrecon.errors import InputError
from simrecon.job import Job, Person, Reading, request
from simrecon.pipeline import Reconstruction
from simrecon.types import Ground, Scene
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


def test_another_reading_of_a_video_finds_its_landmarks_anew(
    run: Reconstruction, tmp_path: Path, asked: list[Job]
) -> None:
    video, kept = tmp_path / "clip.mp4", tmp_path / "out.evidence.npz"
    video.touch()
    kept.touch()
    out = tmp_path / "out"
    results.write(job_of(out, input=str(video), detected=str(kept)), run)
    for words in ([], ["--ignore", "joints"], ["--fov", "40"]):
        cli.main(["rerun", str(out), "-o", str(tmp_path / "again"), *words])
    same, less, anew = asked
    assert (same.detected, less.detected) == (str(kept), str(kept))
    assert (anew.detected, anew.reading.fov_deg) == (None, 40.0)


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


def test_a_motion_does_not_start_another_part_of_the_clip(
    run: Reconstruction, tmp_path: Path, asked: list[Job], capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    results.write(job_of(out, input=str(out / "motion.npz")), run)
    for words in (["--to", "0.2"], ["--from", "0.1"]):
        cli.main(["rerun", str(out), "-o", str(tmp_path / "again"), *words])
    assert [job.start for job in asked] == [str(out / "motion.npz"), None]
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
    words = ["rerun", str(out), "-o", str(tmp_path / "again")]
    words = words if command == "rerun" else ["run", "--job", str(out / "job.toml")]
    points.write_text("changed", encoding="utf-8")
    for more in ([], ["--keypoints", str(others)], ["--keypoints", str(points)]):
        cli.main([*words, *more])
    same, other, again = asked
    assert request.changed(same) == (str(points),)
    assert (other.reading.keypoints, request.changed(other)) == (str(others), ())
    assert (again.reading.keypoints, request.changed(again)) == (str(points), ())
