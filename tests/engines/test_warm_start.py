"""Where a clip begins when no finished motion is at hand; for one that is, see `tests/replay`."""

from __future__ import annotations

import numpy as np

from simrecon.engines import warm_start
from simrecon.sim.state import qpos_of, qvel_of
from tests.engines.conftest import Makers


def test_a_clip_begins_at_the_kinematic_pose_and_velocity_without_knots(make: type[Makers]) -> None:
    problem = make.clip(make.settings())
    start = warm_start.from_fit(problem)
    np.testing.assert_array_equal(qpos_of(problem.model, start.state), problem.qpos[0])
    np.testing.assert_array_equal(qvel_of(problem.model, start.state), problem.qvel0)
    assert start.knots_rad.shape == (0, problem.model.nu)
    assert start.first == 0
