"""Somebody who stands on something, jumps off it, and stands below, before a camera that nobody knows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simrecon import cli, evidence, kinematics, plan, running, suggesting
from simrecon.cli import options
from simrecon.job import Job, Person
from simrecon.observer import SILENT, Observer
from simrecon.scene.suggest.motion import measure
from simrecon.types import Evidence, KinematicFit, Scene
from tests.support import jumping

HIGH_M = 1.2


@pytest.fixture(scope="module")
def seen() -> Evidence:
    return jumping.seen(HIGH_M, on_top_s=1.3, below_s=0.5)


@pytest.fixture(scope="module")
def completed(seen: Evidence) -> tuple[Job, list[str]]:
    notes: list[str] = []

    class Notes(Observer):
        def note(self, line: str) -> None:
            notes.append(line)

    return suggesting.completed(Job("", "", suggest=True), seen, Notes()), notes


def lowest_m(fit: KinematicFit) -> np.ndarray:
    """(T,) of the soles."""
    return measure(fit.body, fit.times_s, fit.qpos).soles_m[..., 2].min(axis=(0, 2))


def top_m(job: Job) -> float:
    """Height of the one box in its scene."""
    size = job.scene.items[0].parameters["size_m"]
    assert isinstance(size, tuple)
    return size[2]


def test_what_is_jumped_off_is_found_over_the_floor_below(completed: tuple[Job, list[str]]) -> None:
    job, notes = completed
    assert not job.suggest
    (item,) = job.scene.items
    assert item.kind == "box"  # two feet side by side stand on no beam
    assert top_m(job) == pytest.approx(HIGH_M, abs=0.12)
    (note,) = notes
    assert note.startswith("supports: step: 2 times, ")


def test_the_clip_is_fitted_on_it(seen: Evidence, completed: tuple[Job, list[str]]) -> None:
    fit = kinematics.fit(seen, completed[0].scene, plan.read("quick").kinematics)
    low = lowest_m(fit)
    top = top_m(completed[0])
    assert np.abs(low[:30] - top).max() < 0.05
    assert np.abs(low[-10:]).max() < 0.05


def test_nothing_is_said_of_low_steps_without_a_size() -> None:
    low = jumping.seen(0.12, on_top_s=0.6, below_s=0.6)
    assert suggesting.suggestions(low, Scene(), Person())[1] == ()


def test_the_result_has_the_scene_that_was_found(seen: Evidence, tmp_path: Path) -> None:
    evidence.write(tmp_path / "clip.npz", seen)
    quick = plan.read("quick")
    few = replace(quick, kinematics=replace(quick.kinematics, evaluations=5))
    job = Job(str(tmp_path / "clip.npz"), str(tmp_path / "out"), plan=few, engine="none", no_report=True)
    result = running.run(replace(job, suggest=True))
    (item,) = result.scene.items
    assert result.job.scene.items == (item,)  # so that a rerun has it too
    assert not result.job.suggest


def test_the_word_on_the_command_line() -> None:
    parsed = cli._parser().parse_args(["run", "clip.npz", "-o", "out", "--scene", "suggest"])
    job = options.apply(parsed, Job("clip.npz", "out"))
    assert job.suggest
    assert job.scene == Scene()
    assert suggesting.completed(Job("", ""), jumping.seen(0.1, 0.2, 0.2), SILENT) == Job("", "")
