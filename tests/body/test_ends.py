"""Sizes of head and feet."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon.types import Array, Skeleton

LENGTHS = {"thigh": 0.42, "shank": 0.42, "forearm": 0.25, "ankle_mtp": 0.14}


def place(skeleton: Skeleton, name: str) -> Array:
    return np.asarray(skeleton.point_offsets_m[skeleton.point_names.index(name)])


def test_a_foot_has_its_sole_under_the_joint_of_the_big_toe() -> None:
    foot = bodies.scaled(LENGTHS | {"mtp_drop": 0.075})
    mtp = place(foot, "left_mtp")
    assert mtp[2] == -0.075
    assert np.hypot(mtp[0], mtp[2]) == pytest.approx(0.14)
    assert place(foot, "left_toe")[2] == place(foot, "left_heel")[2] == -0.075


def test_a_joint_above_the_sole_leaves_the_ankle_as_high_as_the_body_tells() -> None:
    foot = bodies.scaled(LENGTHS | {"mtp_drop": 0.045})
    assert place(foot, "left_mtp")[2] == -0.045
    assert place(foot, "left_heel")[2] < -0.055


def test_a_drop_that_no_standing_foot_has_gives_way_to_the_rest_pose_or_is_not_believed() -> None:
    tilted = LENGTHS | {"mtp_drop": 0.12}
    assert place(bodies.scaled(tilted | {"mtp_rest_drop": 0.06}), "left_mtp")[2] == -0.06
    np.testing.assert_allclose(
        place(bodies.scaled(tilted), "left_mtp"), place(bodies.scaled(LENGTHS), "left_mtp")
    )


def test_the_skull_is_as_large_as_it_was_measured_unless_that_is_no_head() -> None:
    usual, small, odd = (
        bodies.stature_m(bodies.scaled(LENGTHS | more)) for more in ({}, {"skull": 0.19}, {"skull": 0.02})
    )
    assert usual - small == pytest.approx(0.024, abs=0.01)
    assert odd == usual
