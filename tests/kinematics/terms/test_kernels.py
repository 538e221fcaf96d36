"""Pure functions of the terms: values by hand, gradients by finite differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from simrecon.kinematics.terms import image, kernels, touch
from simrecon.types import Array
from tests.support.gradients import differences

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

FUNCTIONS: dict[str, Callable[[Array], tuple[float, Array]]] = {
    "reprojection": lambda x: image.reprojection(x, RAYS, WEIGHTS, CAMERA, 0.2),
    "reprojection, moving": lambda x: image.reprojection(x, RAYS, WEIGHTS, MOVING, 0.2),
    "reprojection, behind": lambda x: image.reprojection(x - [7.0, 0.0, 0.0], RAYS, WEIGHTS, CAMERA, 20.0),
    "distance": lambda x: kernels.distance(x, TARGETS, WEIGHTS, 0.5),
    "acceleration": lambda x: kernels.acceleration(x, 0.1, 20.0),
    "travel": lambda x: kernels.travel(x, 0.1),
    "still": lambda x: kernels.still(x, 0.1, 3.0),
    "outside": lambda x: kernels.outside(x, np.array([-0.5, -0.1, 0.0]), np.array([0.5, 0.1, 0.2]), 0.1),
    "penetration": lambda x: touch.penetration(x, 0.01),
    "touching": lambda x: touch.touching(x, 0.5),
    "touching, weighted": lambda x: touch.touching(x, 0.5, WEIGHTS[..., None]),
    "held": lambda x: kernels.held(x, WEIGHTS[:, 1:], 0.1, 3.0),
    "near": lambda x: kernels.near(x, TARGETS, WEIGHTS[..., None], 0.5),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_gradients_are_those_of_finite_differences(name: str) -> None:
    term = FUNCTIONS[name]
    gradient = term(POINTS)[1]
    assert gradient.shape == POINTS.shape
    np.testing.assert_allclose(gradient, differences(term, POINTS), rtol=1e-5, atol=1e-6)


def test_the_robust_kernel_is_quadratic_near_zero_and_flat_far_away() -> None:
    loss, slope = kernels.cauchy(np.array([0.0, 1.0, 1e6]))
    np.testing.assert_allclose(loss, [0.0, np.log(2.0), np.log(1e6 + 1)])
    np.testing.assert_allclose(slope, [1.0, 0.5, 1 / (1e6 + 1)])


def test_distance_by_hand() -> None:
    loss, gradient = kernels.distance(
        np.array([[[3.0, 4.0, 0.0]]]), np.zeros((1, 1, 3)), np.full((1, 1), 2.0), 5.0
    )
    assert loss == pytest.approx(2 * np.log(2.0))
    np.testing.assert_allclose(gradient, [[[2 * 3 / 25, 2 * 4 / 25, 0.0]]])


def test_acceleration_is_zero_at_constant_velocity() -> None:
    steady = np.arange(T)[None, :, None] * np.array([1.0, -2.0, 0.5])
    loss, gradient = kernels.acceleration(steady, 0.1, 1.0)
    assert loss == pytest.approx(0.0, abs=1e-18)
    np.testing.assert_allclose(gradient, 0.0, atol=1e-9)
    fall = 0.5 * 9.81 * (0.1 * np.arange(T, dtype=float)[None, :, None]) ** 2
    assert kernels.acceleration(fall, 0.1, 9.81)[0] == pytest.approx(T - 2)


def test_slow_points_are_held_and_fast_ones_left_alone() -> None:
    slow, fast = (speed * 0.1 * np.arange(T)[None, :, None] * np.ones(3) for speed in (0.01, 10.0))
    _, held = kernels.still(slow, 0.1, 0.1)
    _, left = kernels.still(fast, 0.1, 0.1)
    # per metre per second, the pull on the fast point is thousands of times weaker
    assert np.abs(held).max() / 0.01 > 1e3 * np.abs(left).max() / 10.0
    assert kernels.still(np.ones((M, T, 3)), 0.1, 0.1)[0] == 0.0


def test_what_lies_within_the_limits_is_free() -> None:
    loss, gradient = kernels.outside(np.array([-0.5, 0.0, 0.5, 0.7]), np.full(4, -0.5), np.full(4, 0.5), 0.1)
    assert loss == pytest.approx(4.0)
    np.testing.assert_allclose(gradient, [0.0, 0.0, 0.0, 40.0])


def test_what_is_held_costs_its_squared_speed() -> None:
    points = np.zeros((1, 3, 3))
    points[0, 1:, 0] = 0.02  # one step at 0.2 m/s
    assert kernels.held(points, np.array([[1.0, 1.0]]), 0.1, 0.1)[0] == pytest.approx(4.0)
    assert kernels.held(points, np.array([[0.0, 1.0]]), 0.1, 0.1)[0] == 0.0
