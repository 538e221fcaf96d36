"""Loads of things on the person, and what scores make of them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from simrecon import planners
from simrecon import replay as motions
from simrecon import scene as scenes
from simrecon.engines import problem as problems
from simrecon.evaluation import items as things
from simrecon.evaluation import simulated
from simrecon.metrics import joints
from simrecon.types import Scene

BLOCK = scenes.item(
    {"name": "block", "kind": "box", "position_m": [0.0, 0.0, 0.0], "size_m": [1.0, 1.0, 0.1]}, "test:"
)


def made(standing: Any, scene: Scene, lift_m: float) -> simulated.Simulated:
    """The person who stands, in a scene, as if read from a folder."""
    fit, before = standing.fit, standing.problem
    qpos = fit.qpos + np.concatenate(([0.0, 0.0, lift_m], np.zeros(fit.qpos.shape[1] - 3)))
    fit = replace(fit, qpos=qpos, scene=scene)
    reference = planners.plan("none", fit, standing.evidence, before.plan)
    problem = problems.pose(fit, reference, standing.evidence, before.clock, before.plan)
    from tests.support.runs import stepped

    frames = np.arange(before.clock.frames)
    motion, _ = motions.record(problem, fit, stepped(problem), fit.times_s, frames)
    return simulated.Simulated(motion, scene, problem.model, {}, None, None)  # type: ignore[arg-type]


def test_loads_of_the_ground_are_no_loads_of_things(standing: Any) -> None:
    aside = replace(BLOCK, position_m=(5.0, 0.0, 0.0))
    of = made(standing, Scene(items=(aside,)), 0.0)
    assert things.loads(of).shape == (len(of.motion.times_s), 1, 3)
    assert not things.loads(of).any()


def test_a_block_under_the_feet_bears_the_person(standing: Any) -> None:
    of = made(standing, Scene(items=(BLOCK,)), 0.1)
    found = things.loads(of)
    np.testing.assert_allclose(found[1:, 0], of.motion.grf_N[1:], atol=1e-6)
    assert found[10:, 0, 2].mean() == pytest.approx(70 * 9.81, rel=0.1)
    rows = things.forces(of.model, of.scene, of.motion.state0, of.motion.ctrl)
    assert rows.shape == (len(of.motion.ctrl) + 1, 2, 3)
    assert not rows[:, 1].any()  # nothing touches the ground


def test_rises_of_hips_and_of_a_load() -> None:
    """Down for a second, up for a second, three times; a load that wavers while up does not count again."""
    height = np.tile(np.repeat([0.5, 0.9], 30), 3)
    assert things.rises(height) == 3
    load = np.tile(np.concatenate((np.full(30, 75.0), np.zeros(30))), 3)
    assert things.releases(load, 1 / 30) == 3
    load[40] = 30.0
    assert things.releases(load, 1 / 30) == 3
    hips = np.zeros((180, 3))
    hips[:, 2] = height
    sitting, standing = things.rests(hips, 1 / 30)
    assert sitting.sum() > 70
    assert standing.sum() == 90
    assert not (sitting & standing).any()


def test_scores_without_things_are_none(standing: Any) -> None:
    of = made(standing, Scene(), 0.0)
    on = joints.clip(
        joints.track(of.motion.times_s, of.motion.joint_names, of.motion.joints_m, "reference"),
        of.motion.times_s,
        Scene(),
    )
    assert things.scores(of, on).values == {}
    block = made(standing, Scene(items=(BLOCK,)), 0.1)
    found = things.scores(block, on).values
    assert found["thing_load_pct"] == pytest.approx(100, abs=1)
    assert 0 <= found["thing_penetration_max_mm"] < 10
    assert "rises" not in found  # nobody sits down
