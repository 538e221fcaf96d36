"""The change of variables that L-BFGS searches in."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from simrecon.kinematics import layout
from simrecon.kinematics.conditioning import Conditioning, condition
from simrecon.kinematics.curvature import curvature
from simrecon.kinematics.layout import AXES, FREE
from simrecon.kinematics.objective import Objective
from simrecon.kinematics.problem import Problem
from simrecon.types import Array
from tests.kinematics.conftest import Repeated


@pytest.fixture(scope="module")
def better(problem: Problem, point: Array) -> Conditioning:
    return condition(curvature(problem, problem.unpack(point)))


def test_conditioning_is_an_invertible_change_of_variables(better: Conditioning, point: Array) -> None:
    rng = np.random.default_rng(9)
    np.testing.assert_allclose(better.to_variables(better.from_variables(point)), point, atol=1e-10)
    u, g = rng.normal(size=(2, len(point)))
    np.testing.assert_allclose(better.from_variables(better.to_variables(u)), u, atol=1e-8)
    # linear, and the gradient's map is its transpose: ⟨A u, g⟩ = ⟨u, Aᵀ g⟩
    np.testing.assert_allclose(
        better.to_variables(u) + better.to_variables(2 * g), better.to_variables(u + 2 * g), atol=1e-9
    )
    assert better.to_variables(u) @ g == pytest.approx(u @ better.gradient(g))


def test_conditioning_keeps_the_gradient_right(better: Conditioning, problem: Problem, point: Array) -> None:
    objective = Objective(problem)

    def scaled(u: Array) -> tuple[float, Array]:
        loss, gradient = objective(better.to_variables(u))
        return loss, better.gradient(gradient)

    u, rng = better.from_variables(point), np.random.default_rng(10)
    gradient = scaled(u)[1]
    for _ in range(20):
        step = 1e-5 * rng.normal(size=len(u))
        slope = (scaled(u + step)[0] - scaled(u - step)[0]) / 2
        assert gradient @ step == pytest.approx(slope, rel=1e-4, abs=1e-7)


def test_conditioning_makes_curvatures_alike(better: Conditioning, problem: Problem, point: Array) -> None:
    """By a random direction in each kind of variable: without it they differ by many orders of magnitude."""
    objective, rng = Objective(problem), np.random.default_rng(11)

    def bent(function: Callable[[Array], float], x: Array, rows: slice, size: float) -> float:
        step = np.zeros_like(x)
        step[rows] = rng.normal(size=len(x[rows]))
        step *= size / np.linalg.norm(step)
        return abs(function(x + step) + function(x - step) - 2 * function(x)) / size**2

    places, own = AXES * problem.frames, FREE * problem.frames
    kinds = (slice(0, places), slice(places, own), slice(own, own + 1), slice(own + 1, own + 2))
    u = better.from_variables(point)
    raw = [bent(lambda x: objective(x)[0], point, rows, 1e-4) for rows in kinds]
    new = [bent(lambda x: objective(better.to_variables(x))[0], u, rows, 1e-2) for rows in kinds]
    assert max(new) / min(new) < max(raw) / min(raw)


def test_numbers_that_are_widened_when_they_are_needed_are_the_same(
    better: Conditioning, problem: Problem, point: Array, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("simrecon.kinematics.conditioning.WIDE", 0)
    narrow = condition(curvature(problem, problem.unpack(point)))
    assert [band.dtype for band in (*narrow.columns, *better.columns)] == [np.float32, np.float64]
    np.testing.assert_array_equal(narrow.to_variables(point), better.to_variables(point))
    np.testing.assert_array_equal(narrow.gradient(point), better.gradient(point))


@pytest.mark.parametrize("frames", [9, 12, 14])
def test_a_curvature_in_blocks_is_that_of_the_whole(
    repeated: Repeated, monkeypatch: pytest.MonkeyPatch, frames: int
) -> None:
    long, x = repeated(frames)
    variables = long.unpack(x)
    (whole,) = curvature(long, variables)
    better = condition([whole])
    monkeypatch.setattr("simrecon.kinematics.curvature.BLOCK", 4)
    parts = list(curvature(long, variables))
    assert len(parts) == -(-frames // 4)
    for k, block in enumerate(whole.blocks):
        joined = np.concatenate([part.blocks[k] for part in parts])
        np.testing.assert_allclose(joined, block, rtol=0, atol=1e-9 * np.abs(block).max())
    wide = np.concatenate([part.wide() for part in parts])
    np.testing.assert_allclose(wide, whole.wide(), rtol=0, atol=1e-9 * np.abs(wide).max())
    corner = sum(part.corner for part in parts)
    np.testing.assert_allclose(corner, whole.corner, rtol=0, atol=1e-9 * np.abs(corner).max())
    again = condition(parts)
    for name in ("to_variables", "from_variables", "gradient"):
        one, other = (getattr(map_, name)(x) for map_ in (better, again))
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-4 * np.abs(one).max())


def test_the_factor_is_that_of_the_hessian(problem: Problem, point: Array) -> None:
    """M Mᵀ is H, but for the digits that L lacks and the damping."""
    (part,) = curvature(problem, problem.unpack(point))
    frames, count = problem.frames, len(part.corner)
    own = FREE * frames
    hessian = np.zeros((own + count, own + count))
    for k, block in enumerate(part.blocks):
        for t, values in enumerate(block):
            row, column = slice(FREE * (t + k), FREE * (t + k + 1)), slice(FREE * t, FREE * (t + 1))
            hessian[row, column] = values
            hessian[column, row] = values.T
    hessian[:own, own:] = part.wide().reshape(own, -1)
    hessian[own:, :own] = hessian[:own, own:].T
    hessian[own:, own:] = part.corner
    better, eye = condition([part]), np.eye(own + count)
    order = layout.by_frame(np.arange(own + count, dtype=float), frames)
    packed = np.concatenate(order).astype(int)  # where the unknowns of frame after frame are packed
    across = np.stack([better.from_variables(row[np.argsort(packed)]) for row in eye])  # Mᵀ by columns
    np.testing.assert_allclose(across @ across.T, hessian, rtol=0, atol=1e-5 * np.abs(hessian).max())
