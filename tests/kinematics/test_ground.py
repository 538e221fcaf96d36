"""The ground plane is found under bodies that stand, jump or lie."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon.body import primitives
from simrecon.geometry import rotations
from simrecon.kinematics import forward, ground
from simrecon.types import Array
from tests.kinematics.conftest import Makers

Skin = tuple[Array, Array, Array]
"""Points of the left foot, the right foot and the whole body, (T, P, 3) each."""


@pytest.fixture(scope="module")
def skin(make: Makers) -> Skin:
    """Surface of a person who walks on z = 0."""
    walk = make.walking(20)
    parts = primitives.make(walk.skeleton, 1.75, 70.0, 0.0)
    base = np.broadcast_to(np.eye(3), (20, 3, 3))
    pose = forward.forward(walk.skeleton, walk.root_m, base, walk.rotvecs, 1.0)
    return ground.skin(walk.skeleton, parts, pose, 1.0, 0.0)


def test_the_surface_touches_the_floor(skin: Skin) -> None:
    left, right, body = skin
    lowest = body[..., 2].min(axis=1)
    assert np.abs(lowest).max() < 0.01
    assert np.minimum(left[..., 2].min(axis=1), right[..., 2].min(axis=1)) == pytest.approx(lowest, abs=1e-9)


def test_the_gradient_is_that_of_finite_differences(skin: Skin) -> None:
    left, right, body = skin
    parts, plane = ((1.0, left), (1.0, right), (2.0, body)), np.array([0.05, -0.08, 0.03])
    _, gradient = ground.loss(parts, plane)
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = 1e-6
        slope = (ground.loss(parts, plane + step)[0] - ground.loss(parts, plane - step)[0]) / 2e-6
        assert gradient[axis] == pytest.approx(slope, rel=1e-4)


def off(move: Array, turn: Array, shift: Array) -> tuple[float, float]:
    """Angle (degrees) of the floor that was found, and its height (m) under the clip."""
    both = move[:3, :3] @ turn
    return float(np.degrees(np.arccos(np.clip(both[2, 2], -1, 1)))), float(
        (move[:3, :3] @ shift + move[:3, 3])[2]
    )


@pytest.mark.parametrize("airborne", [0, 12], ids=["walks", "flies for most frames"])
def test_a_tilted_floor_is_found(skin: Skin, airborne: int) -> None:
    turn, shift = rotations.matrix(rotations.exp(np.array([0.08, -0.06, 0.3]))), np.array([0.4, -1.0, 0.7])
    rise = np.zeros((20, 1, 3))
    rise[4 : 4 + airborne, 0, 2] = 0.5
    move = ground.transform(*((points + rise) @ turn.T + shift for points in skin), tilt=True)
    angle, height = off(move, turn, shift)
    assert angle < 2.5
    assert abs(height) < 0.03


def test_a_level_floor_keeps_its_normal(skin: Skin) -> None:
    move = ground.transform(*(points + np.array([0.0, 0.0, 0.3]) for points in skin), tilt=False)
    np.testing.assert_allclose(move[:3, :3], np.eye(3), atol=1e-12)
    assert move[2, 3] == pytest.approx(-0.3, abs=0.02)


def test_someone_who_lies_has_the_floor_under_the_body(skin: Skin) -> None:
    lying = rotations.matrix(rotations.exp(np.array([0.0, -np.pi / 2, 0.0])))
    moved = [points[:1] @ lying.T for points in skin]
    low = np.array([0.0, 0.0, moved[2][..., 2].min()])
    move = ground.transform(*(points - low for points in moved), tilt=False)
    assert abs(move[2, 3]) < 0.04
