from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import simrecon
from simrecon import cli, people, plan, results, running
from simrecon.batch import clips
from simrecon.cli.run import worst
from simrecon.errors import InputError, SimreconError
from simrecon.evidence.video import detection, weights
from simrecon.job import Job, Person, Reading
from simrecon.results import folder
from tests.support import video_files as files
from tests.support.video_files import BLUE, GREEN, RED

FRAMES = 16


@pytest.fixture
def clip(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Two people who stay, and one who is there for two frames."""
    monkeypatch.setenv("SIMRECON_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(weights, "find", lambda name: (Path(name), f"hash of {name}"))
    monkeypatch.setattr(detection, "Networks", lambda *_: files.Rectangles())
    images = []
    for t in range(FRAMES):
        there = [(40 + t, 60, 80, RED), (130, 60, 60, GREEN)]
        images.append(files.scene(there + ([(85, 60, 40, BLUE)] if t in (4, 5) else [])))
    return files.write(tmp_path / "clip.mp4", images, 25.0)


def asked(clip: Path, out: Path) -> Job:
    quick = plan.read("quick")
    few = replace(quick, kinematics=replace(quick.kinematics, evaluations=3))
    return Job(str(clip), str(out), Reading(person="all"), plan=few, engine="none", no_report=True)


def test_everybody_has_a_result_seen_by_one_camera(clip: Path, tmp_path: Path) -> None:
    first, second = simrecon.run_people(asked(clip, tmp_path / "out"))
    assert (first.number, second.number) == (1, 2)
    assert first.result is not None
    assert second.result is not None
    assert [one.name for one in folder.people(tmp_path / "out")] == ["person1", "person2"]
    ours, theirs = first.result.report["camera"], second.result.report["camera"]
    for key in ("K", "world_to_camera", "image_size_px"):
        np.testing.assert_allclose(ours[key], theirs[key], atol=1e-8)
    assert second.result.report["assumed"]["camera"]["origin"] == "given"
    assert second.result.job.reading.camera == str((tmp_path / "out" / people.CAMERA).resolve())
    apart = first.result.motion.joints_m.mean(axis=1) - second.result.motion.joints_m.mean(axis=1)
    assert np.linalg.norm(apart, axis=1).min() > 0.5  # in one world, each in their own place
    with pytest.raises(
        InputError, match=r"the results of several people; valid: one of .*person1, .*person2"
    ):
        results.open_result(tmp_path / "out")
    again = tmp_path / "again"
    assert cli.main(["rerun", str(tmp_path / "out"), "-o", str(again), "--seed", "1"]) == 0
    assert [one.name for one in folder.people(again)] == ["person1", "person2"]


def test_a_camera_of_ones_own_stays(tmp_path: Path) -> None:
    camera = {"K": np.eye(3), "dist": np.zeros(5), "image_size_px": (640, 480)}
    report: dict[str, Any] = {
        "camera": camera | {"world_to_camera": [np.eye(4)[:3]]},
        "assumed": {"camera": {"origin": "estimated"}},
    }
    path = tmp_path / people.CAMERA
    assert people._keep(report, path) == people._keep(report, path) == path
    path.write_text("# mine\n", encoding="utf-8")
    assert people._keep(report, path) == tmp_path / "shared_camera-2.toml"
    assert path.read_text(encoding="utf-8") == "# mine\n"


def test_who_fails_keeps_nobody_else_from_a_result(
    clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    real = running.run

    def failing(job: Job, *args: object, **named: object) -> results.Result:
        if job.reading.person == "1":
            raise SimreconError("diverged")
        return real(job, *args, **named)  # type: ignore[arg-type]

    monkeypatch.setattr(running, "run", failing)
    outcomes = people.run_people(asked(clip, tmp_path / "out"))
    assert [one.result is None for one in outcomes] == [True, False]
    assert (tmp_path / "out" / people.CAMERA).is_file()  # of the first who has a result
    told = ["run", str(clip), "-o", str(tmp_path / "again"), "--person", "all", "--engine", "none"]
    assert cli.main([*told, "--plan", "quick", "--no-report"]) == 1
    assert "person 1 of 2\nfailed   diverged\n\nperson 2 of 2\nperson   1." in capsys.readouterr().out


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({"person": Person(height_m=1.8)}, "--height-m: found beside --person all; valid: a run of one"),
        ({"reading": Reading(person="all", person_at_px=(1.0, 2.0))}, "--person-at: found beside --person"),
        ({"reading": Reading(person="2")}, "--person: found '2' for .*; valid: all, with a video"),
    ],
)
def test_what_is_said_of_one_person(
    said: dict[str, object], message: str, clip: Path, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=message):
        people.run_people(replace(asked(clip, tmp_path / "out"), **said))  # type: ignore[arg-type]


def test_one_run_and_a_batch_are_of_one_person(clip: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="found all for a person, which makes several results"):
        running.run(asked(clip, tmp_path / "out"))
    with pytest.raises(InputError, match=r"clip.mp4: person: found 'all'; valid in a batch: the number"):
        clips.collect([str(clip)], {"person": "all"})


@pytest.mark.parametrize(("statuses", "status"), [([0, 0], 0), ([0, 3], 3), ([3, 1, 0], 1), ([], 0)])
def test_the_worst_exit_status(statuses: list[int], status: int) -> None:
    assert worst(statuses) == status
