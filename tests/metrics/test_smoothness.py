from __future__ import annotations

import numpy as np
import pytest

from simrecon.geometry import rotations
from simrecon.metrics import smoothness
from simrecon.metrics.statistics import of_frames
from simrecon.types import Array

FPS = 10.0


def mean(values: Array, scale: float = 1.0) -> float:
    return of_frames(values, scale=scale).value


def test_the_two_velocity_errors_differ_on_a_turned_path() -> None:
    """Reference walks along x at 2 m/s, the motion along y at 1 m/s."""
    time = np.arange(5) / FPS
    truth = time[:, None, None] * np.array([2.0, 0, 0]) * np.ones((1, 3, 1))
    joints = time[:, None, None] * np.array([0.0, 1, 0]) * np.ones((1, 3, 1)) + 7.0
    assert mean(smoothness.velocity_errors(joints, truth), FPS) == pytest.approx(np.sqrt(5))
    assert mean(smoothness.speed_errors(joints, truth), FPS) == pytest.approx(1.0)
    assert mean(smoothness.acceleration_errors(joints, truth), FPS**2) == pytest.approx(0, abs=1e-9)


def test_acceleration_of_free_fall() -> None:
    fall = np.zeros((6, 2, 3))
    fall[..., 2] = -0.5 * 9.81 * (np.arange(6)[:, None] / FPS) ** 2
    errors = smoothness.acceleration_errors(fall, np.zeros_like(fall))
    np.testing.assert_allclose(errors * FPS**2, 9.81)


def test_velocity_does_not_depend_on_the_rate_and_e_smooth_does() -> None:
    """A motion at 2 m/s against a reference at 1 m/s in the same direction."""
    for rate in (25.0, 50.0):
        way = np.arange(40)[:, None, None] / rate * np.array([1.0, 0, 0]) * np.ones((1, 3, 1))
        assert mean(smoothness.velocity_errors(2 * way, way), rate) == pytest.approx(1.0)
        assert mean(smoothness.speed_errors(2 * way, way)) == pytest.approx(1.0 / rate)
        assert mean(smoothness.foot_step_errors(2 * way, way)) == pytest.approx(1.0 / rate)


def test_feet_of_xie() -> None:
    truth = np.zeros((5, 2, 3))
    feet = truth + np.array([0.3, 0.0, 0.02])
    feet[:, 1, 2] = -0.04
    assert mean(smoothness.foot_height_errors(feet, truth)) == pytest.approx(0.03)
    feet[:, :, 2] += np.arange(5)[:, None]  # vertical steps don't count
    np.testing.assert_allclose(smoothness.foot_step_errors(feet, truth), 0, atol=1e-12)


def test_jitter_of_a_cubic() -> None:
    times = np.arange(20) / 30
    path = np.zeros((20, 2, 3))
    path[..., 1] = times[:, None] ** 3
    np.testing.assert_allclose(smoothness.jerks(path, 30.0), 6.0)
    parabola = np.repeat(times[:10, None, None] ** 2, 3, axis=2)
    np.testing.assert_allclose(smoothness.jerks(parabola, 30.0), 0, atol=1e-6)


def test_unknown_joints_are_left_out(rng: np.random.Generator) -> None:
    walk = rng.normal(size=(12, 4, 3))
    moved = walk + np.array([0.0, 0.0, 0.1])
    moved[5, 3], moved[9] = np.nan, np.nan
    assert mean(smoothness.velocity_errors(moved, walk)) == pytest.approx(0, abs=1e-9)


def test_errors_do_not_change_under_a_turn_or_in_a_batch(rng: np.random.Generator) -> None:
    a, b = rng.normal(size=(2, 3, 6, 12, 3))
    turn = rotations.matrix(rotations.exp([0.3, -0.2, 1.0])).T
    for errors in (smoothness.velocity_errors, smoothness.speed_errors, smoothness.acceleration_errors):
        np.testing.assert_allclose(errors(a @ turn + 4.0, b @ turn + 4.0), errors(a, b), atol=1e-9)
        np.testing.assert_allclose(errors(a, b), [errors(x, y) for x, y in zip(a, b, strict=True)])
    np.testing.assert_allclose(smoothness.jerks(a @ turn, 30.0), smoothness.jerks(a, 30.0))
