"""`simrecon synthesize` and its plain call: files, page, and what they refuse."""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import simrecon
from simrecon import cli, evidence, futures, running, synthesis
from simrecon.errors import InputError
from simrecon.io import atomic
from simrecon.synthesis import Futures
from simrecon.types import Ground
from tests.support.futures import known
from tests.support.runs import hasty, seen


@pytest.fixture(scope="module")
def motion(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A squat of a second as motion capture."""
    one = known()
    path = tmp_path_factory.mktemp("motion") / "squat.npz"
    whole = replace(seen(one.body, one.qpos), times_s=one.times_s, trust="mocap", sha256="")
    bare = np.empty((len(one.qpos), 0))
    evidence.write(
        path,
        replace(
            whole, keypoint_names=(), keypoints_px=bare[..., None].repeat(2, 2), scores=bare, camera=None
        ),
    )
    return path


@pytest.fixture(scope="module")
def folder(motion: Path) -> Path:
    assert cli.main(["synthesize", str(motion), "-o", str(motion.parent / "next"), "--samples", "2"]) == 0
    return motion.parent / "next"


def test_futures_are_files_that_are_read_as_evidence(folder: Path) -> None:
    files = sorted(folder.glob("future_*.npz"))
    assert [path.name for path in files] == ["future_00.npz", "future_01.npz"]
    for path in files:
        future = evidence.read(path)
        np.testing.assert_allclose(future.times_s[[0, -1]], [3.0, 5.0])
        assert (future.trust, future.joints_frame) == (futures.TRUST, "world")
        assert np.isfinite(future.joints_m).all()
    told = json.loads((folder / "synthesis.json").read_text(encoding="utf-8"))
    assert (told["at_s"], told["seed"], told["files"]) == (3.0, 0, [path.name for path in files])
    assert (folder / "motion" / "motion.npz").is_file()


def test_the_page_shows_them_as_ghosts(folder: Path) -> None:
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert '"ghosts":{"from_s":1.0,"to_s":3.0,"count":2}' in page


def test_a_fitted_motion_is_a_result_of_its_own(folder: Path, motion: Path) -> None:
    made = simrecon.synthesize(folder / "motion", motion.parent / "again", at_s=2.6, samples=1, seed=4)
    assert made.results == ()
    np.testing.assert_allclose(made.futures.times_s[0], 2.6)
    with pytest.raises(InputError, match="found options of the person for a result"):
        simrecon.synthesize(folder / "motion", motion.parent / "x", person=simrecon.Person(mass_kg=60.0))
    scene = simrecon.Scene(ground=Ground(height_m=0.3))
    with pytest.raises(InputError, match="found options of the scene for a result"):
        simrecon.synthesize(folder / "motion", motion.parent / "x", scene=scene)
    with pytest.raises(InputError, match="holds a result, which would be lost"):
        simrecon.synthesize(motion, folder / "motion")
    with pytest.raises(InputError, match="found a file; valid: a folder"):
        simrecon.synthesize(folder / "motion", motion)


def test_futures_of_an_earlier_synthesis_go(folder: Path, motion: Path) -> None:
    new = motion.parent / "twice"
    for samples in (2, 1):
        simrecon.synthesize(folder / "motion", new, at_s=2.6, samples=samples)
    assert [path.name for path in new.glob("*.npz")] == ["future_00.npz"]


def test_files_of_others_stay(folder: Path, motion: Path) -> None:
    new = motion.parent / "mine"
    simrecon.synthesize(folder / "motion", new, at_s=2.6, samples=2)
    others = {"future_00_edited.npz": b"mine", "future_2026.npz": b"too", "future_01.npz": b"edited"}
    for name, content in others.items():
        (new / name).write_bytes(content)
    simrecon.synthesize(folder / "motion", new, at_s=2.6, samples=1)
    assert {name: (new / name).read_bytes() for name in others} == others
    with pytest.raises(InputError, match=r"future_01.npz: found a file that is not as a synthesis wrote it"):
        simrecon.synthesize(folder / "motion", new, samples=2)
    for name in ("report.html", "synthesis.json", "future_00.npz"):
        alone = motion.parent / f"alone-{name}"
        alone.mkdir()
        (alone / name).write_text("{}")
        with pytest.raises(InputError, match=f"{name}: found a file that is not as a synthesis wrote it"):
            simrecon.synthesize(folder / "motion", alone, samples=1)
        assert (alone / name).read_text() == "{}"


def test_a_synthesis_that_is_cut_off_is_done_again(
    folder: Path, motion: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    new = motion.parent / "cut"
    with monkeypatch.context() as patch:
        patch.setattr(atomic, "write_bytes", full_after(atomic.write_bytes, 2))
        with pytest.raises(InputError, match=r"cannot be written \(No space left on device\)"):
            simrecon.synthesize(folder / "motion", new, at_s=2.6, samples=2)
    assert [path.name for path in new.glob("*.npz")] == ["future_00.npz"]
    made = simrecon.synthesize(folder / "motion", new, at_s=2.6, samples=2)
    assert all(path.is_file() for path in made.files)


def full_after(write: Callable[..., None], count: int) -> Callable[..., None]:
    """Writes so many files, then finds the disk full."""
    left = [count]

    def limited(path: Path, content: bytes, **more: Any) -> None:
        left[0] -= 1
        if left[0] < 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write(path, content, **more)

    return limited


def test_what_is_impossible_is_one_line(
    folder: Path, motion: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    new = str(motion.parent / "y")
    assert cli.main(["synthesize", str(folder / "motion"), "-o", new, "--at", "9"]) == 2
    assert "--at: found 9 s; valid: 2.47 to 3.00 s" in capsys.readouterr().err
    assert cli.main(["synthesize", str(motion), "-o", new, "--at", "9"]) == 2  # before anything is fitted
    assert "--at: found 9 s; valid: 2.47 to 3.00 s" in capsys.readouterr().err
    assert cli.main(["synthesize", str(folder / "motion"), "-o", new, "--samples", "0"]) == 2
    assert "--samples: found 0; valid: a whole number from 1 to 1000" in capsys.readouterr().err
    assert cli.main(["synthesize", str(folder / "motion"), "-o", new, "--engine", "none"]) == 2
    assert "found --planner, --engine or --contacts" in capsys.readouterr().err
    with pytest.raises(InputError, match="found the field 'sceen', did you mean 'scene'"):
        simrecon.synthesize(motion, new, sceen=None)
    assert not Path(new).exists()


def test_futures_are_simulated_into_results(
    folder: Path, motion: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = known()
    short = Futures(one.body, one.scene, one.times_s[:8], np.empty((1, 8, 19, 3)), one.qpos[None, :8])
    monkeypatch.setattr(synthesis, "predict", lambda *_: short)
    made = simrecon.synthesize(
        folder / "motion",
        motion.parent / "run",
        samples=1,
        simulate=True,
        plan=hasty(),
        threads=1,
        no_report=True,
    )
    (result,) = made.results
    assert result.folder.name == "future_00"
    assert (result.motion.status == 0).all()
    assert abs(result.body.height_m - one.body.height_m) < 0.01


def test_a_simulation_uses_the_job(monkeypatch: pytest.MonkeyPatch, folder: Path, motion: Path) -> None:
    jobs: list[Any] = []
    monkeypatch.setattr(running, "run", lambda job, *_, **__: jobs.append(job))
    one = known()
    short = Futures(one.body, one.scene, one.times_s[:8], np.empty((1, 8, 19, 3)), one.qpos[None, :8])
    monkeypatch.setattr(synthesis, "predict", lambda *_: short)
    simrecon.synthesize(
        folder / "motion", motion.parent / "job", samples=1, simulate=True, plan=hasty(), seed=7
    )
    assert (jobs[0].seed, jobs[0].plan, jobs[0].scene) == (7, hasty(), one.scene)
