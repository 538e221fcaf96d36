"""Covariances of CMA-ES: the algebra of the low-rank one, and costs that grow with the variables only."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from simrecon.optim import covariance as covariances
from simrecon.optim.covariance import Covariance, LowRank, Shape


def learned(kind: Covariance, n: int, count: int) -> Shape:
    """After so many updates by random steps along a line that all variables share."""
    shape, rng = covariances.identity(kind, n, 0.1), np.random.default_rng(0)
    for _ in range(count):
        steps = shape.colour(rng.standard_normal((20, n)))
        steps += 3.0 * rng.standard_normal((20, 1))
        shape.update(0.9, 0.01, steps[0], np.linspace(0.01, -0.005, 20), steps)
    return shape


class Counted(np.ndarray):
    """An array that counts the multiplications and the like of what is done with it."""

    operations = 0

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        plain = [np.asarray(value) for value in inputs]
        if "out" in options:
            options["out"] = tuple(np.asarray(value) for value in options["out"])
        result = getattr(ufunc, method)(*plain, **options)
        if ufunc is np.matmul:
            Counted.operations += plain[0].shape[-1] * np.size(result)
        else:
            Counted.operations += max(np.size(result), *(value.size for value in plain))
        return np.asarray(result).view(Counted)


def operations(n: int, covariance: Covariance) -> int:
    """Element operations, an upper bound in products, of colouring, whitening and learning 50 samples."""
    shape = learned(covariance, n, 2)
    for name, value in vars(shape).items():
        if isinstance(value, np.ndarray):
            setattr(shape, name, value.view(Counted))
    normal = np.random.default_rng(0).standard_normal((50, n)).view(Counted)
    Counted.operations = 0
    steps = shape.colour(normal)
    shape.whiten(steps[0])
    shape.distance2(steps[25:])
    shape.update(0.9, 0.01, steps[0], np.linspace(0.01, -0.005, 50), steps)
    return Counted.operations


@pytest.mark.parametrize("covariance", ["diagonal", "low_rank"])
def test_cost_is_linear_in_the_variables(covariance: Covariance) -> None:
    assert operations(400, covariance) > 400 * 50
    assert operations(4000, covariance) <= 10.5 * operations(400, covariance)
    assert operations(400, "full") > 12 * operations(100, "full")


def test_low_rank_algebra_is_that_of_its_matrix() -> None:
    shape, steps = learned("low_rank", 30, 60), np.random.default_rng(1).standard_normal((7, 30))
    factor = shape.colour(np.eye(30)).T
    matrix = factor @ factor.T
    assert np.linalg.matrix_rank(matrix - np.diag(np.diag(matrix))) > 0
    np.testing.assert_allclose(shape.whiten(shape.colour(steps)), steps, atol=1e-9)
    expected = np.einsum("pi,ij,pj->p", steps, np.linalg.inv(matrix), steps)
    np.testing.assert_allclose(shape.distance2(steps), expected, rtol=1e-6)
    assert isinstance(shape, LowRank)
    np.testing.assert_allclose(shape._axes @ shape._axes.T, np.eye(len(shape._axes)), atol=1e-9)


def test_low_rank_projection_is_exact_where_the_updated_matrix_has_its_form() -> None:
    """Directions along axes on an isotropic rest: eq. 47 stays within the model, so nothing is lost."""
    n, shape = 12, covariances.identity("low_rank", 12, 0.1)
    path, steps = 3.0 * np.eye(n)[0], 2.0 * np.eye(n)[1:4]
    expected = np.ones(n)
    for _ in range(3):
        shape.update(0.7, 0.2, path, np.full(3, 0.1), steps)
        expected *= 0.7
        expected[:4] += [1.8, 0.4, 0.4, 0.4]
    factor = shape.colour(np.eye(n)).T
    np.testing.assert_allclose(factor @ factor.T, np.diag(expected), rtol=1e-9, atol=1e-9)
