"""The Jacobian that comes piece by piece is that of whole rollouts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon import kinematics, schedule
from simrecon import scene as scenes
from simrecon.engines import warm_start
from simrecon.engines.problem import Problem
from simrecon.engines.sampling import jacobian
from simrecon.engines.sampling.task import Task
from simrecon.geometry import camera as cameras
from simrecon.optim import gauss_newton
from simrecon.plan import Plan
from simrecon.sim.rollout import Simulator
from tests.engines.conftest import Makers

BALL = """
[[item]]
name = "ball"
kind = "ball"
position_m = [1.0, 0.0, 0.0]
mass_kg = 2.0
"""
ALL = {
    "prior": 0.05,
    "total_variation": 1.0,
    "joint_limit": 1.0,
    "landmark": 100.0,
    "landmark_velocity": 0.5,
    "prior_rate_hz": 15.0,
}


def clip(make: type[Makers], plan: Plan, kind: str) -> Problem:
    """A person who sways: on the floor, before a camera, or beside a ball that may roll."""
    if kind == "ball":
        return make.clip(plan, replace(make.standing(), scene=scenes.parse(BALL)))
    if kind == "floor":
        return make.clip(plan)
    fit = make.standing(make.camera)
    points = kinematics.configurations(fit.body, fit.qpos)[1]
    nose = fit.body.skeleton.point_names.index("nose")
    pixels = cameras.project(make.camera, points[:, [nose]]) + 3.0
    seen = replace(
        make.unseen(),
        keypoint_names=("Nose",),
        keypoints_px=pixels,
        scores=np.full((len(points), 1), 0.8),
        camera=make.camera,
    )
    return make.clip(plan, fit, seen)


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("kind", ["floor", "camera", "ball"])
def test_the_jacobian_is_that_of_whole_rollouts(make: type[Makers], threads: int, kind: str) -> None:
    losses = ALL | ({"rate_hz": 15.0, "reprojection": 1.0} if kind == "camera" else {})
    plan = make.settings(population=20, start=0.02, **losses)
    problem = clip(make, plan, kind)
    (window,) = schedule.cut(problem.clock, plan)
    task = Task(problem, window, warm_start.from_fit(problem))
    simulator, scale = Simulator(problem.model, 20, threads), task.deviations()
    x = task.warm_start() + np.random.default_rng(0).normal(size=len(scale)) * 0.1 * scale
    slopes = jacobian.linearise(task, simulator, x, scale)

    here = task.residuals(simulator.run(task.states(x[None]), task.control(x[None]), task.at_steps))
    roots = [term.roots() for term in here]
    residual = gauss_newton.residuals(here, roots).ravel()
    rows = []
    for k in range(len(x)):
        moved = x.copy()
        moved[k] += jacobian.DIFFERENCE * scale[k]
        rolled = simulator.run(task.states(moved[None]), task.control(moved[None]), task.at_steps)
        after = gauss_newton.residuals(task.residuals(rolled), roots).ravel()
        rows.append((after - residual) / jacobian.DIFFERENCE)
    expected = np.array(rows)
    np.testing.assert_allclose(slopes.gradient, expected @ residual, rtol=1e-9, atol=1e-9)
    squares = expected @ expected.T
    np.testing.assert_allclose(slopes.curvature, squares, rtol=1e-4, atol=1e-6 * squares.max())
    np.testing.assert_array_equal(slopes.curvature, slopes.curvature.T)
    assert 2 < slopes.evaluations < 2 + len(x)
