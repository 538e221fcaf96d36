"""Loads of items on the person, and what scores make of them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from simrecon import planners
from simrecon import replay as motions
from simrecon import scene as scenes
from simrecon.engines import problem as problems
from simrecon.evaluation import items, loads
from simrecon.evaluation.comparison import comparison, track
from simrecon.evaluation.simulated import Simulated
from simrecon.types import Scene

BLOCK = scenes.item(
    {"name": "block", "kind": "box", "position_m": [0.0, 0.0, 0.0], "size_m": [1.0, 1.0, 0.1]}, "test:"
)


def simulated(standing: Any, scene: Scene, lift_m: float) -> Simulated:
    """The person who stands, in a scene, as if read from a folder."""
    fit, before = standing.fit, standing.problem
    qpos = fit.qpos + np.concatenate(([0.0, 0.0, lift_m], np.zeros(fit.qpos.shape[1] - 3)))
    fit = replace(fit, qpos=qpos, scene=scene)
    reference = planners.plan("none", fit, standing.evidence, before.plan)
    problem = problems.pose(fit, reference, standing.evidence, before.clock, before.plan)
    from tests.support.runs import stepped

    frames = np.arange(before.clock.frames)
    motion, _ = motions.record(problem, fit, stepped(problem), fit.times_s, frames)
    return Simulated(motion, scene, problem.model, {}, None, None)  # type: ignore[arg-type]


def test_loads_of_the_ground_are_no_loads_of_items(standing: Any) -> None:
    aside = replace(BLOCK, position_m=(5.0, 0.0, 0.0))
    result = simulated(standing, Scene(items=(aside,)), 0.0)
    assert loads.loads(result.model, result.scene, result.motion).shape == (len(result.motion.times_s), 1, 3)
    assert not loads.loads(result.model, result.scene, result.motion).any()


def test_a_block_under_the_feet_bears_the_person(standing: Any) -> None:
    result = simulated(standing, Scene(items=(BLOCK,)), 0.1)
    force = loads.loads(result.model, result.scene, result.motion)
    np.testing.assert_allclose(force[1:, 0], result.motion.grf_N[1:], atol=1e-6)
    assert force[10:, 0, 2].mean() == pytest.approx(70 * 9.81, rel=0.1)
    rows = loads.forces(result.model, result.scene, result.motion.state0, result.motion.ctrl)
    assert rows.shape == (len(result.motion.ctrl) + 1, 2, 3)
    assert not rows[:, 1].any()  # nothing touches the ground


def test_scores_without_items_are_none(standing: Any) -> None:
    result = simulated(standing, Scene(), 0.0)
    on = comparison(
        track(result.motion.times_s, result.motion.joint_names, result.motion.joints_m, "reference"),
        result.motion.times_s,
        Scene(),
    )
    assert items.scores(result, on).values == {}
    block = simulated(standing, Scene(items=(BLOCK,)), 0.1)
    values = items.scores(block, on).values
    assert values["item_load_pct"] == pytest.approx(100, abs=1)
    assert 0 <= values["item_penetration_max_mm"] < 10
    assert "rises" not in values  # nobody sits down
