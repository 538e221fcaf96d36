"""Terms of the kinematic objective: values by hand, gradients by finite differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from simrecon.kinematics import terms
from simrecon.types import Array

M, T = 3, 5
RNG = np.random.default_rng(3)
POINTS, TARGETS = RNG.normal(size=(M, T, 3)), RNG.normal(size=(M, T, 3))
WEIGHTS = RNG.uniform(0, 1, (M, T))
RAYS = RNG.normal(size=(M, T, 2))
CAMERA = np.eye(4)
CAMERA[:3, :3] = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
CAMERA[2, 3] = 5.0
MOVING = np.tile(CAMERA, (T, 1, 1))
MOVING[:, 0, 3] = np.arange(T)

TERMS: dict[str, Callable[[Array], tuple[float, Array]]] = {
    "reprojection": lambda x: terms.reprojection(x, RAYS, WEIGHTS, CAMERA, 0.2),
    "reprojection, moving": lambda x: terms.reprojection(x, RAYS, WEIGHTS, MOVING, 0.2),
    "reprojection, behind": lambda x: terms.reprojection(x - [7.0, 0.0, 0.0], RAYS, WEIGHTS, CAMERA, 20.0),
    "distance": lambda x: terms.distance(x, TARGETS, WEIGHTS, 0.5),
    "acceleration": lambda x: terms.acceleration(x, 0.1, 20.0),
    "travel": lambda x: terms.travel(x, 0.1),
    "still": lambda x: terms.still(x, 0.1, 3.0),
    "outside": lambda x: terms.outside(x, np.array([-0.5, -0.1, 0.0]), np.array([0.5, 0.1, 0.2]), 0.1),
    "penetration": lambda x: terms.penetration(x, 0.01),
    "touching": lambda x: terms.touching(x, 0.5),
    "touching, weighted": lambda x: terms.touching(x, 0.5, WEIGHTS[..., None]),
    "held": lambda x: terms.held(x, WEIGHTS[:, 1:], 0.1, 3.0),
    "near": lambda x: terms.near(x, TARGETS, WEIGHTS[..., None], 0.5),
}


@pytest.mark.parametrize("name", TERMS)
def test_gradients_are_those_of_finite_differences(name: str) -> None:
    term = TERMS[name]
    _, gradient = term(POINTS)
    assert gradient.shape == POINTS.shape
    for index in np.ndindex(POINTS.shape):
        ahead, behind = POINTS.copy(), POINTS.copy()
        ahead[index] += 1e-6
        behind[index] -= 1e-6
        slope = (term(ahead)[0] - term(behind)[0]) / 2e-6
        assert gradient[index] == pytest.approx(slope, rel=1e-5, abs=1e-6)


def test_the_robust_kernel_is_quadratic_near_zero_and_flat_far_away() -> None:
    loss, slope = terms.cauchy(np.array([0.0, 1.0, 1e6]))
    np.testing.assert_allclose(loss, [0.0, np.log(2.0), np.log(1e6 + 1)])
    np.testing.assert_allclose(slope, [1.0, 0.5, 1 / (1e6 + 1)])


def test_reprojection_by_hand() -> None:
    # 5 m in front of the camera, which looks along x with y to its left
    point = np.array([[[0.0, -1.0, 0.5]]])
    loss, _ = terms.reprojection(point, np.array([[[0.2, -0.1]]]), np.ones((1, 1)), CAMERA, 0.1)
    assert loss == pytest.approx(0.0, abs=1e-12)
    loss, _ = terms.reprojection(point, np.array([[[0.3, -0.1]]]), np.full((1, 1), 0.5), CAMERA, 0.1)
    assert loss == pytest.approx(0.5 * np.log(2.0))


def test_distance_by_hand() -> None:
    loss, gradient = terms.distance(
        np.array([[[3.0, 4.0, 0.0]]]), np.zeros((1, 1, 3)), np.full((1, 1), 2.0), 5.0
    )
    assert loss == pytest.approx(2 * np.log(2.0))
    np.testing.assert_allclose(gradient, [[[2 * 3 / 25, 2 * 4 / 25, 0.0]]])


def test_acceleration_is_zero_at_constant_velocity() -> None:
    steady = np.arange(T)[None, :, None] * np.array([1.0, -2.0, 0.5])
    loss, gradient = terms.acceleration(steady, 0.1, 1.0)
    assert loss == pytest.approx(0.0, abs=1e-18)
    np.testing.assert_allclose(gradient, 0.0, atol=1e-9)
    fall = 0.5 * 9.81 * (0.1 * np.arange(T)[None, :, None]) ** 2
    assert terms.acceleration(fall, 0.1, 9.81)[0] == pytest.approx(T - 2)


def test_slow_points_are_held_and_fast_ones_left_alone() -> None:
    slow, fast = (speed * 0.1 * np.arange(T)[None, :, None] * np.ones(3) for speed in (0.01, 10.0))
    _, held = terms.still(slow, 0.1, 0.1)
    _, left = terms.still(fast, 0.1, 0.1)
    # per metre per second, the pull on the fast point is thousands of times weaker
    assert np.abs(held).max() / 0.01 > 1e3 * np.abs(left).max() / 10.0
    assert terms.still(np.ones((M, T, 3)), 0.1, 0.1)[0] == 0.0


def test_the_gradient_of_balance_is_that_of_finite_differences() -> None:
    rng = np.random.default_rng(5)
    com = rng.normal([0.0, 0.0, 0.9], [0.2, 0.2, 0.05], (8, 3))
    feet = rng.normal([[[0.0, 0.1, 0.0]], [[0.0, -0.1, 0.0]]], 0.05, (2, 8, 3))
    standing = np.array([[1, 1, 1, 0, 0, 0.5, 1, 1], [1, 0.1, 0.8, 0.9, 0, 0.2, 1, 0]], dtype=float)

    def loss(where: Array) -> tuple[float, Array]:
        feet_m = where[8:24].reshape(2, 8, 3)
        value, *slopes, d_borne = terms.balance(where[:8], feet_m, standing, where[24:, 0], 0.2, 0.05)
        slopes.append(np.outer(d_borne, [1.0, 0.0, 0.0]))
        return value, np.concatenate([slope.reshape(-1, 3) for slope in slopes])

    where = np.concatenate((com, feet.reshape(16, 3), rng.uniform(0, 1, (8, 3))))
    _, gradient = loss(where)
    assert np.abs(gradient).max() > 1
    for index in np.ndindex(where.shape):
        ahead, behind = where.copy(), where.copy()
        ahead[index] += 1e-6
        behind[index] -= 1e-6
        slope = (loss(ahead)[0] - loss(behind)[0]) / 2e-6
        assert slope == pytest.approx(gradient[index], abs=1e-4 * max(1.0, abs(slope)))


def test_who_stands_over_a_foot_is_in_balance_and_who_leans_is_not() -> None:
    feet = np.zeros((2, 5, 3))
    feet[:, :, 1] = [[0.1], [-0.1]]
    both, left = np.ones((2, 5)), np.stack((np.ones(5), np.zeros(5)))
    over, lean, right = (
        np.tile(place, (5, 1)) for place in ([0.0, 0.0, 0.9], [0.3, 0.0, 0.9], [0.0, -0.1, 0.9])
    )
    alone = np.ones(5)
    assert terms.balance(over, feet, both, alone, 0.1, 0.05)[0] == 0.0
    assert terms.balance(lean, feet, both, alone, 0.1, 0.05)[0] > 1.0
    assert terms.balance(right, feet, both, alone, 0.1, 0.05)[0] == 0.0
    assert terms.balance(right, feet, left, alone, 0.1, 0.05)[0] > 1.0
    assert terms.balance(lean, feet, np.zeros((2, 5)), alone, 0.1, 0.05)[0] == 0.0
    assert terms.balance(lean, feet, both, np.zeros(5), 0.1, 0.05)[0] == 0.0  # something else bears, too


def test_what_lies_within_the_limits_is_free() -> None:
    loss, gradient = terms.outside(np.array([-0.5, 0.0, 0.5, 0.7]), np.full(4, -0.5), np.full(4, 0.5), 0.1)
    assert loss == pytest.approx(4.0)
    np.testing.assert_allclose(gradient, [0.0, 0.0, 0.0, 40.0])


def test_only_depth_is_penetration() -> None:
    loss, gradient = terms.penetration(np.array([0.3, 0.0, -0.02]), 0.01)
    assert loss == pytest.approx(4.0)
    np.testing.assert_allclose(gradient, [0.0, 0.0, -400.0])


def test_the_pull_to_a_support_fades_with_distance() -> None:
    loss, gradient = terms.touching(np.array([0.0, 0.05, 5.0]), 0.05)
    assert loss == pytest.approx(0.5 + 1.0, abs=1e-3)
    assert gradient[0] == 0.0
    assert gradient[1] == pytest.approx(10.0)
    assert abs(gradient[2]) < 1e-3


def test_what_is_held_costs_its_squared_speed() -> None:
    points = np.zeros((1, 3, 3))
    points[0, 1:, 0] = 0.02  # one step at 0.2 m/s
    assert terms.held(points, np.array([[1.0, 1.0]]), 0.1, 0.1)[0] == pytest.approx(4.0)
    assert terms.held(points, np.array([[0.0, 1.0]]), 0.1, 0.1)[0] == 0.0
