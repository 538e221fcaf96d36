"""Unknowns of the kinematic fit, packed and unpacked."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon.geometry import rotations
from simrecon.kinematics import layout
from simrecon.kinematics.layout import FREE, SEGMENTS, Variables, leans
from simrecon.types import Array

T, LENGTHS, LEANS = 5, 6, 3


@pytest.fixture
def variables(rng: np.random.Generator) -> Variables:
    root, rotvecs = rng.normal(size=(T, 3)), rng.normal(size=(SEGMENTS, T, 3))
    return Variables(root, rotvecs, 0.1, -0.02, rng.normal(size=LENGTHS), rng.normal(size=(LEANS, 3)))


def test_the_skeleton_has_as_many_segments() -> None:
    skeleton = bodies.scaled({}, 1.75)
    assert len(skeleton.names) == SEGMENTS
    assert len(skeleton.limits_rad) == layout.JOINTS


def test_variables_survive_packing(variables: Variables) -> None:
    again = Variables.unpack(variables.pack(), T, LENGTHS)
    for name in ("root_m", "rotvecs", "lengths", "lean"):
        np.testing.assert_array_equal(getattr(again, name), getattr(variables, name))
    assert (again.log_scale, again.sole_m) == (0.1, -0.02)


def test_frame_after_frame_is_another_order_of_the_same(variables: Variables) -> None:
    x = variables.pack()
    own, shared = layout.by_frame(x, T)
    np.testing.assert_array_equal(layout.from_frames(own, shared), x)
    frame = own.reshape(T, FREE)[2]
    np.testing.assert_array_equal(frame[layout.ROOT], [*variables.root_m[2], *variables.rotvecs[0, 2]])
    np.testing.assert_array_equal(frame[layout.JOINT_TURNS], variables.rotvecs[1:, 2].ravel())
    assert frame[layout.turn(5, 1)] == variables.rotvecs[5, 2, 1]
    assert list(shared[:2]) == [variables.log_scale, variables.sole_m]


def test_parts_of_a_packed_vector_are_views(variables: Variables) -> None:
    x = variables.pack()
    for part in layout.split(x, T):
        part[...] = 0.0
    assert not x.any()


def test_configurations_and_back(variables: Variables) -> None:
    base = rotations.matrix(rotations.exp(np.linspace(0, 1, 3 * T).reshape(T, 3)))
    rotvecs = 0.5 * variables.rotvecs
    qpos = layout.to_qpos(variables.root_m, base, rotvecs)
    root, orientation, again = layout.from_qpos(qpos)
    np.testing.assert_array_equal(root, variables.root_m)
    np.testing.assert_allclose(orientation, base @ rotations.matrix(rotations.exp(rotvecs[0])), atol=1e-12)
    np.testing.assert_allclose(again[1:], rotvecs[1:], atol=1e-12)
    assert not again[0].any()


def test_long_clips_have_no_more_leans_than_short_ones() -> None:
    ten_minutes: Array = leans(18_000, 1 / 30)
    assert ten_minutes.shape[1] == leans(600, 1 / 30).shape[1] < 40
    np.testing.assert_allclose(np.sqrt((ten_minutes**2).mean(axis=0)), 1.0, rtol=1e-6)
