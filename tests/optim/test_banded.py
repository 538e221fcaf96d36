"""Normal equations by bands against an explicit Jacobian."""

from __future__ import annotations

import math

import numpy as np
import pytest

from simrecon.optim.banded import Banded
from simrecon.types import Array

F, V, X = 7, 4, 9
MOST = 3


def explicit(slope: Array, weights: Array, moves: Array) -> Array:
    """J (X, R) of √ω times differences of slope (F, K, V), with weights (F - n, K), by moves (F, V, X)."""
    by_frame = slope @ moves  # (F, K, X)
    order = len(slope) - len(weights)
    differences = np.diff(by_frame, n=order, axis=0)
    return (np.sqrt(weights)[..., None] * differences).reshape(-1, moves.shape[-1]).T


def assert_close(found: Array, expected: Array) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-6 * np.abs(expected).max())


@pytest.mark.parametrize("orders", [(0,), (1,), (3,), (0, 1, 3), (3, 0, 3)], ids=str)
@pytest.mark.parametrize("frames", [F, MOST + 1])
def test_squares_are_those_of_an_explicit_jacobian(
    orders: tuple[int, ...], frames: int, rng: np.random.Generator
) -> None:
    moves = rng.normal(size=(frames, V, X))
    banded, jacobian, residual = Banded(frames, V, MOST), list[Array](), list[Array]()
    for rows, order in enumerate(orders, start=2):
        slope, vectors = rng.normal(size=(frames, rows, V)), rng.normal(size=(frames - order, rows))
        weights = rng.uniform(0, 5, size=vectors.shape)
        banded.add(slope, vectors, weights)
        jacobian.append(explicit(slope, weights, moves))
        residual.append((np.sqrt(weights) * vectors).ravel())
    whole = np.concatenate(jacobian, axis=1)
    curvature, gradient = banded.squares(moves.astype(np.float32))
    assert curvature.dtype == gradient.dtype == np.float64
    assert_close(curvature, whole @ whole.T)
    assert_close(gradient, whole @ np.concatenate(residual))


def test_the_gradient_is_that_of_the_sum_of_squares(rng: np.random.Generator) -> None:
    slope, moves, x = rng.normal(size=(F, 2, V)), rng.normal(size=(F, V, X)), rng.normal(size=X)
    weights = rng.uniform(1, 2, size=(F - 3, 2))

    def squares(x: Array) -> float:
        vectors = np.diff((slope @ (moves @ x)[..., None])[..., 0], n=3, axis=0)
        return float((weights * vectors**2).sum())

    banded = Banded(F, V, MOST)
    banded.add(slope, np.diff((slope @ (moves @ x)[..., None])[..., 0], n=3, axis=0), weights)
    expected = [(squares(x + step) - squares(x - step)) / 2e-4 for step in 1e-4 * np.eye(X)]
    assert_close(2 * banded.squares(moves.astype(np.float32))[1], np.array(expected))


def test_room_for_more_differences_than_frames_is_no_trouble(rng: np.random.Generator) -> None:
    banded, moves = Banded(2, V, MOST), rng.normal(size=(2, V, X))
    slope = rng.normal(size=(2, 3, V))
    single = moves.astype(np.float32)
    for found in banded.squares(single):
        assert not found.any()
    banded.add(slope, np.diff(rng.normal(size=(2, 3)), axis=0), np.ones((1, 3)))
    jacobian = explicit(slope, np.ones((1, 3)), moves)
    assert_close(banded.squares(single)[0], jacobian @ jacobian.T)


def test_third_differences_weigh_frames_as_binomials_do() -> None:
    banded = Banded(4, 1, MOST)
    banded.add(np.ones((4, 1, 1)), np.ones((1, 1)), np.ones((1, 1)))
    signs = [(-1) ** (3 - k) * math.comb(3, k) for k in range(4)]
    assert banded.squares(np.eye(4, dtype=np.float32).reshape(4, 1, 4))[1].tolist() == signs
