"""Loss terms on values that can be worked out by hand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from simrecon.engines.sampling import losses
from simrecon.geometry import rotations
from simrecon.types import Array

F, B, M, D = 5, 17, 6, 48
LIMITS = np.tile([-0.5, 0.4], (16, 3, 1))
CAMERA = np.eye(4)
CAMERA[2, 3] = 3.0


def test_com_position_sums_squares_over_frames() -> None:
    target = np.zeros((3, 3))
    com = np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 2.0], [0.0, 3.0, 0.0]])
    assert losses.com_position(com, target) == pytest.approx(9.0 + 9.0)


def test_com_velocity_is_of_differences_per_second() -> None:
    com = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.0, 0.2]])
    target = np.array([[5.0, 0.0, 0.0], [5.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
    # 1 m/s along x, then 2 m/s along z; a constant offset has no velocity
    assert losses.com_velocity(com, target, 0.1) == pytest.approx(1.0 + 4.0)


def test_pose_sums_half_the_angles() -> None:
    angles = np.array([[0.0, 0.4], [1.0, 3.0]])  # (F, B)
    targets = rotations.exp(np.zeros((2, 2, 3)))
    turned = rotations.exp(angles[..., None] * [0.6, 0.0, 0.8])
    # eq. 2 takes arccos of the quaternions' product, which is half of the angle of rotation
    assert losses.pose(turned, targets) == pytest.approx(angles.sum() / 2)
    assert losses.pose(-turned, targets) == pytest.approx(angles.sum() / 2)


def test_pose_bears_rounding() -> None:
    unit = np.full((1, 1, 4), 0.5) * (1 + 1e-15)
    assert np.isfinite(losses.pose(unit, unit))


def test_reprojection_is_a_distance_weighted_by_scores() -> None:
    points = np.array([[[0.0, 0.0, 1.0], [1.0, 2.0, -1.0]]])  # (1, 2, 3), at depths 4 and 2
    rays = np.array([[[0.3, 0.4], [0.5, 0.5]]])
    scores = np.array([[1.0, 0.5]])
    assert losses.reprojection(points, rays, scores, CAMERA) == pytest.approx(0.5 + 0.5 * 0.5)


def test_reprojection_with_a_moving_camera() -> None:
    moving = np.stack([CAMERA, CAMERA])
    moving[1, 0, 3] = 3.0  # the camera's x is 3 m more: image moves by 1 at depth 3
    points, rays, scores = np.zeros((2, 1, 3)), np.zeros((2, 1, 2)), np.ones((2, 1))
    assert losses.reprojection(points, rays, scores, moving) == pytest.approx(1.0)


def test_points_beside_or_behind_the_camera_stay_finite() -> None:
    points = np.array([[[1.0, 0.0, -3.0], [1.0, 0.0, -9.0]]])
    # as if 0.1 m in front
    assert losses.reprojection(points, np.zeros((1, 2, 2)), np.ones((1, 2)), CAMERA) == pytest.approx(20.0)


def test_prior_is_a_length_by_frame() -> None:
    assert losses.prior(np.array([[3.0, 4.0], [0.0, 2.0]])) == pytest.approx(5.0 + 2.0)


def test_total_variation_is_of_accelerations() -> None:
    frames = np.arange(6.0)
    steady = np.stack((frames**2, 2 * frames, 1 + 0 * frames), axis=-1)[:, None]  # (F, 1, 3)
    np.testing.assert_allclose(losses.total_variation(steady), 0.0, atol=1e-12)
    jerky = steady.repeat(2, axis=1)  # (F, 2, 3)
    jerky[:, 0, 2] += frames**3
    # third differences of t³ are 6, at three places, on one of two joints
    assert losses.total_variation(jerky) == pytest.approx(3 * 6.0 / 2)


def test_joint_limit_grows_exponentially_outside_the_range() -> None:
    rotvecs = np.zeros((2, 16, 3))
    rotvecs[0, 3] = [0.4, -0.5, 0.1]
    assert losses.joint_limit(rotvecs, LIMITS) == 0.0
    rotvecs[0, 3, 0], rotvecs[1, 5, 2] = 0.5, -0.7
    assert losses.joint_limit(rotvecs, LIMITS) == pytest.approx(np.e - 1 + np.e**2 - 1)
    rotvecs[:] = 1e3
    assert np.isfinite(losses.joint_limit(rotvecs, LIMITS))


def test_landmark_velocity_is_that_of_the_distance() -> None:
    points = np.zeros((3, 2, 3))
    points[:, 1, 0] = [0.0, 0.1, 0.3]  # 1 and 2 m/s
    assert losses.landmark_velocity(points, 0 * points, np.array([9.0, 0.5]), 0.1) == pytest.approx(2.5)
    assert losses.landmark_velocity(points + 7.0, 0 * points, np.ones(2), 0.1) == pytest.approx(5.0)


def test_landmark_sums_squares() -> None:
    points = np.zeros((2, 3, 3))
    points[0, 1], points[1, 2] = [1.0, 2.0, 2.0], [0.0, 0.0, 1.0]
    assert losses.landmark(points, np.zeros((2, 3, 3)), np.ones(3)) == pytest.approx(10.0)
    assert losses.landmark(points, 0 * points, np.array([1.0, 2.0, 3.0])) == pytest.approx(21.0)


def test_rotation_vectors_leave_the_base_out(rng: np.random.Generator) -> None:
    rotvecs = rng.uniform(-1, 1, (4, F, B, 3))
    found = losses.joint_rotvecs(rotations.exp(rotvecs))
    np.testing.assert_allclose(found, rotvecs[..., 1:, :], atol=1e-12)


def quats(rng: np.random.Generator, *shape: int) -> Array:
    return rotations.exp(rng.normal(size=(*shape, 3)))


RNG = np.random.default_rng(1)
COM, POINTS, QUATS = RNG.normal(size=(F, 3)), RNG.normal(size=(F, M, 3)), quats(RNG, F, B)
RAYS = POINTS[..., :2] / (POINTS[..., 2:] + 10.0)
FAR = np.eye(4)
FAR[2, 3] = 10.0
TERMS: dict[str, tuple[Callable[[Array], Array], Array]] = {
    "com_position": (lambda x: losses.com_position(x, COM), COM),
    "com_velocity": (lambda x: losses.com_velocity(x, COM, 0.1), COM),
    "pose": (lambda x: losses.pose(x, QUATS), QUATS),
    "reprojection": (lambda x: losses.reprojection(x, RAYS, np.ones((F, M)), FAR), POINTS),
    "prior": (losses.prior, np.zeros((F, D))),
    "total_variation": (losses.total_variation, np.ones((F, M, 3))),
    "joint_limit": (lambda x: losses.joint_limit(x, LIMITS), np.zeros((F, 16, 3))),
    "landmark": (lambda x: losses.landmark(x, POINTS, np.linspace(0.5, 2.0, POINTS.shape[-2])), POINTS),
    "landmark_velocity": (
        lambda x: losses.landmark_velocity(x, POINTS, np.linspace(0.5, 2.0, POINTS.shape[-2]), 0.1),
        POINTS,
    ),
}


@pytest.mark.parametrize("name", TERMS)
def test_terms_are_zero_at_the_target_and_positive_elsewhere(name: str) -> None:
    term, target = TERMS[name]
    # arccos keeps half of the digits near zero
    assert 0 <= term(target) < 1e-6
    elsewhere = quats(RNG, F, B) if name == "pose" else target + RNG.normal(size=target.shape)
    assert term(elsewhere) > 0.01


@pytest.mark.parametrize("name", TERMS)
def test_terms_are_batched_over_leading_axes(name: str) -> None:
    term, target = TERMS[name]
    batch = target + np.random.default_rng(2).normal(size=(2, 3, *target.shape))
    if name == "pose":
        batch = rotations.canonical(batch)
    found = term(batch)
    assert found.shape == (2, 3)
    for i in range(2):
        for j in range(3):
            assert found[i, j] == pytest.approx(term(batch[i, j]))
