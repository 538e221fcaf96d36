"""Why frames are not simulated, on a squat that is bent into what can't be simulated."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from simrecon import replay
from simrecon.results import ending
from simrecon.types import Motion, Scene, SceneItem


def stopped(run: Any, **fit: Any) -> Any:
    """The run with no window solved, and another kinematic fit."""
    motion, audit = replay.record(run.problem, run.fit, (), run.motion.times_s, np.delete(np.arange(10), 4))
    return replace(run, windows=(), motion=motion, audit=audit, fit=replace(run.fit, **fit))


def said(run: Any) -> dict[str, Any]:
    (found,) = ending.make(run)
    return found


def test_a_whole_simulation_has_no_ending(run: Any) -> None:
    assert ending.make(run) == []


def test_what_could_be_followed_fell_and_the_next_plan_is_tried(run: Any) -> None:
    found = said(stopped(run))
    assert (found["reason"], found["plan"]) == ("fell", "default")
    assert (found["from_s"], found["to_s"]) == (pytest.approx(1 / 30), pytest.approx(0.3))


def test_a_person_out_of_view_is_lost(run: Any) -> None:
    found = said(stopped(run, interpolated=np.ones(10, dtype=bool)))
    assert (found["reason"], found["plan"]) == ("lost", None)
    assert "100 % of the frames" in found["detail"]


def test_a_reference_inside_an_item_or_the_floor(run: Any) -> None:
    sunk = run.problem.qpos.copy()
    sunk[:, 2] -= 0.3
    found = said(replace(stopped(run), problem=replace(run.problem, qpos=sunk)))
    assert found["reason"] == "penetration"
    assert "the floor" in found["detail"]


def test_a_reference_that_no_body_could_follow(run: Any) -> None:
    seconds = np.arange(10) / 30
    pulled, hanging = run.fit.com_m.copy(), run.problem.points_m.copy()
    pulled[:, 2] -= 0.5 * 30.0 * seconds**2
    found = said(stopped(run, com_m=pulled))
    assert found["reason"] == "impossible reference"
    assert "pulled down" in found["detail"]
    assert found["load_weights"][0] == pytest.approx(1 - 30 / 9.81, abs=0.3)
    thrown = run.fit.com_m.copy()
    thrown[:, 2] += 0.5 * 90.0 * seconds**2
    assert "times the person's weight from the floor" in said(stopped(run, com_m=thrown))["detail"]
    hanging[..., 2] += 0.6
    air = replace(stopped(run), problem=replace(run.problem, points_m=hanging))
    assert "stands in the air" in said(air)["detail"]


def test_a_fast_turn_asks_for_the_plan_of_flips(run: Any) -> None:
    turning = run.problem.orientations.copy()
    angle = 12.0 * np.arange(10) / 30
    turning[:, 0] = np.stack((np.cos(angle / 2), np.sin(angle / 2), 0 * angle, 0 * angle), axis=-1)
    found = said(replace(stopped(run), problem=replace(run.problem, orientations=turning)))
    assert (found["reason"], found["plan"]) == ("fell", "flips")


def test_an_item_is_named(run: Any) -> None:
    item = SceneItem("crate", "box", (9.0, 0.0, 0.0), {"size_m": (0.4, 0.8, 0.12)})
    assert said(stopped(run, scene=Scene(items=(item,))))["reason"] == "fell"  # it is far away


def test_a_fall_is_found(run: Any) -> None:
    motion: Motion = run.motion
    times = np.arange(60) / 100
    qpos = np.zeros((60, motion.qpos.shape[1]))
    still = replace(motion, times_s=times, qpos=qpos, kinematic_qpos=qpos.copy())
    assert not ending.fell(still)
    assert not ending.fell(replace(still, kinematic_qpos=None))
    low = qpos.copy()
    low[5:8, 2] -= 0.5  # 20 ms: a slip of the fit
    assert not ending.fell(replace(still, qpos=low))
    low[5:, 2] -= 0.5
    assert ending.fell(replace(still, qpos=low))
