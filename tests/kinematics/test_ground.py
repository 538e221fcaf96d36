"""The ground plane is found under bodies that stand, jump or lie."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon import scene as scenes
from simrecon.body import primitives
from simrecon.geometry import rotations
from simrecon.kinematics import forward, ground
from simrecon.types import Array, Scene, SceneItem
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


@pytest.mark.parametrize("pitch_rad", [0.0, 0.3])
def test_who_stands_on_the_ball_of_a_foot_has_the_floor_there_and_not_at_the_tip(
    make: Makers, pitch_rad: float
) -> None:
    walk = make.walking(2)
    parts, rotvecs = primitives.make(walk.skeleton, 1.75, 70.0, 0.0), 0 * walk.rotvecs
    ankle = walk.skeleton.names.index("left_ankle")
    rotvecs[ankle] = [0.0, pitch_rad, 0.0]  # toes down
    base = np.broadcast_to(np.eye(3), (2, 3, 3))
    pose = forward.forward(walk.skeleton, walk.root_m, base, rotvecs, 1.0)
    (tip, *_, whole), (ball, *_, same) = (
        ground.skin(walk.skeleton, parts, pose, 1.0, 0.0, toes=toes) for toes in (True, False)
    )
    skeleton = walk.skeleton
    at = [skeleton.point_names.index(f"left_{name}") for name in ("heel", "toe", "mtp")]
    heel, toe, _ = forward.points(pose, skeleton.point_segments[at], skeleton.point_offsets_m[at])
    down = (heel - toe)[:, 2] / np.linalg.norm(heel - toe, axis=-1)
    toes_m = float(np.ptp(skeleton.point_offsets_m[at[1:], 0]))
    rise = ball[..., 2].min(axis=1) - tip[..., 2].min(axis=1)
    np.testing.assert_allclose(rise, toes_m * down, atol=0.008)
    assert down.min() > 0.3
    assert whole.shape == same.shape


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


def stances(*heights_m: float) -> tuple[Array, Array, Array, Array]:
    """Feet that stand at each height for ten frames, the body over them, and how surely they stand."""
    low = np.repeat(heights_m, 10)
    points = np.zeros((len(low), 4, 3))
    points[..., 2] = low[:, None]
    return points, points, points + np.array([0.0, 0.0, 0.1]), np.ones((2, len(low)))


@pytest.mark.parametrize(
    ("heights_m", "floor_m"),
    [
        ((0.0, 0.0, 0.01), 0.0),
        ((0.3, 0.3, 0.3, 0.0, 0.3), 0.0),  # a step down from a box
        ((0.14, 0.12, 0.0, -0.12, 0.01, 0.14, 0.13), -0.12),  # over uneven terrain
    ],
)
def test_a_level_floor_is_the_lowest_on_which_feet_stand(
    heights_m: tuple[float, ...], floor_m: float
) -> None:
    assert ground.level(*stances(*heights_m)) == pytest.approx(floor_m, abs=1e-9)


def test_a_sole_that_is_too_low_for_a_moment_makes_no_floor() -> None:
    left, right, body, standing = stances(*np.zeros(20))
    left[5:10, :, 2] = -0.08  # five of four hundred
    assert ground.level(left, right, body, standing) == 0.0


def test_without_stances_the_floor_is_under_the_body() -> None:
    left, right, body, standing = stances(0.5, 0.5, 0.2)
    assert ground.level(left, right, body, 0 * standing) == pytest.approx(0.3)


def box(x: float, length: float, top: float) -> SceneItem:
    table = {"name": "box", "kind": "box", "position_m": [x, 0.0, 0.0], "size_m": [length, 2.0, top]}
    return scenes.item(table, "test:")


def test_the_gradient_among_items_is_that_of_finite_differences(skin: Skin) -> None:
    left, right, body = skin
    parts, plane = ((1.0, left), (1.0, right), (2.0, body)), np.array([0.05, -0.08, 0.03])
    around = ground.Around(Scene(items=(box(0.3, 1.0, 0.1),)), np.array([0.1, -0.05, 0.0]))
    _, gradient = ground.loss(parts, plane, around)
    assert ground.loss(parts, plane)[0] != ground.loss(parts, plane, around)[0]
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = 1e-6
        ends = [ground.loss(parts, plane + sign * step, around)[0] for sign in (1, -1)]
        assert gradient[axis] == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-3)


@pytest.mark.parametrize("tilt", [False, True])
@pytest.mark.parametrize("length", [20.0, 0.5], ids=["walks on a platform", "steps over a box"])
def test_items_count_as_supports(skin: Skin, length: float, tilt: bool) -> None:
    """Who walks on a platform all the time has the ground below it."""
    item = box(float(skin[2][..., 0].mean()), length, 0.4)
    tops = scenes.support_height(Scene(items=(item,)), skin[2][..., :2].mean(axis=1))  # (T,)
    lifted = [points + tops[:, None, None] * np.array([0.0, 0.0, 1.0]) + [0.0, 0.0, 0.15] for points in skin]
    move = ground.transform(*lifted, tilt=tilt, scene=Scene(items=(item,)))
    assert move[2, 3] == pytest.approx(-0.15, abs=0.03)
    if length > 1.0:
        blind = ground.transform(*lifted, tilt=tilt)
        assert blind[2, 3] == pytest.approx(-0.55, abs=0.03)
