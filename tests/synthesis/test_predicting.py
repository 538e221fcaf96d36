"""Futures as poses of the person: they follow the prediction, and begin where the person is."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon import kinematics, synthesis
from simrecon import plan as plans
from simrecon.errors import InputError
from simrecon.synthesis import Futures
from simrecon.synthesis.features import FUTURE, POINTS
from tests.support.futures import joints, known, network

PLAN = plans.read("quick").kinematics


@pytest.fixture(scope="module")
def made() -> Futures:
    return synthesis.predict(known(), 3.0, 2, 0, PLAN, network(move=1e-4))


def test_futures_begin_at_the_moment(made: Futures) -> None:
    motion = known()
    np.testing.assert_allclose(made.times_s, 3.0 + np.arange(FUTURE + 1) / 30)
    assert made.qpos.shape == (2, FUTURE + 1, motion.qpos.shape[1])
    np.testing.assert_allclose(made.joints_m[:, 0], np.repeat(joints(motion)[None, -1], 2, axis=0), atol=1e-9)
    own = kinematics.configurations(motion.body, made.qpos[:, 0])[1]
    now = kinematics.configurations(motion.body, motion.qpos[-1:])[1]
    assert np.linalg.norm(own - now, axis=-1).mean() < 0.02


def test_poses_are_near_what_is_predicted_and_over_the_floor(made: Futures) -> None:
    names = made.body.skeleton.point_names
    for qpos, predicted in zip(made.qpos, made.joints_m, strict=True):
        marks = kinematics.configurations(made.body, qpos)[1]
        own = marks[:, [names.index(name) for name in POINTS]]
        assert np.linalg.norm(own - predicted, axis=-1).mean() < 0.05
        assert marks[..., 2].min() > -0.03


@pytest.mark.parametrize("at_s", [2.3, 3.2, -1.0])
def test_the_half_second_before_must_be_known(at_s: float) -> None:
    with pytest.raises(InputError, match=r"--at: found .* s; valid: 2\.47 to 3\.00 s"):
        synthesis.predict(known(), at_s, 1, 0, PLAN, network())


def test_a_motion_that_is_too_short_is_said() -> None:
    with pytest.raises(InputError, match="valid: a motion of half a second or more"):
        synthesis.predict(known(10), 2.3, 1, 0, PLAN, network())
