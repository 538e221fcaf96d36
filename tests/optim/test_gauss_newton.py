"""Gauss-Newton: the same gradient as the robust loss, Newton on quadratics, the covariance of samples."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from simrecon.optim.gauss_newton import Quadratic, Term
from simrecon.types import Array
from tests.support.residuals import residuals

Loss = Callable[[Array], Array]

RNG = np.random.default_rng(3)


@pytest.mark.parametrize(
    ("rho", "slope"),
    [
        (lambda s: s**2, None),
        (lambda s: s, np.ones_like),
        (lambda s: np.expm1(s / 0.4), lambda s: np.exp(s / 0.4) / 0.4),
    ],
    ids=["square", "norm", "exponential"],
)
def test_the_weighted_squares_have_the_gradient_of_the_loss(rho: Loss, slope: Loss | None) -> None:
    slopes, offset = RNG.normal(size=(5, 7, 3)), RNG.normal(size=(7, 3))
    weight = RNG.uniform(0.5, 2.0, 7)

    def vectors(x: Array) -> Array:
        return np.einsum("nkd,pn->pkd", slopes, x) + offset

    def loss(x: Array) -> Array:
        return np.sum(weight * rho(np.linalg.norm(vectors(x), axis=-1)), axis=-1)

    here, step = RNG.normal(size=5) * 0.1, 1e-6
    term = Term(vectors(here[None]), weight, slope, floor=1e-9)
    roots = [term.roots()]
    moved = here + step * np.eye(5)
    at = residuals([term], roots).reshape(1, -1)
    after = residuals([Term(vectors(moved), weight, slope)], roots).reshape(5, -1)
    gradient = 2 * (after - at) / step @ at[0]
    expected = (loss(moved) - loss(here - step * np.eye(5))) / (2 * step)
    np.testing.assert_allclose(gradient, expected, rtol=1e-5)


def test_vectors_of_few_frames_are_those_of_the_last_ones() -> None:
    positions, velocities = RNG.normal(size=(2, 4, 5, 3)), RNG.normal(size=(2, 3, 3))
    terms = [Term(positions, 4.0), Term(velocities, 9.0)]
    rows = residuals(terms, [term.roots() for term in terms])
    assert rows.shape == (2, 4, 18)
    np.testing.assert_allclose(rows[..., :15], 2.0 * positions.reshape(2, 4, 15))
    np.testing.assert_allclose(rows[:, 1:, 15:], 3.0 * velocities)
    assert not rows[:, 0, 15:].any()


def test_lengths_below_the_floor_count_as_the_floor() -> None:
    term = Term(np.zeros((1, 2, 3)), 4.0, np.ones_like, floor=0.5)
    np.testing.assert_allclose(term.roots(), 2.0)


def test_steps_solve_the_damped_equations() -> None:
    jacobian, residual = RNG.normal(size=(6, 40)), RNG.normal(size=40)
    dampings = np.array([0.0, 1.0, 100.0])
    quadratic = Quadratic(jacobian @ jacobian.T, jacobian @ residual)
    steps = [quadratic.step(damping) for damping in dampings]
    for damping, step in zip(dampings, steps, strict=True):
        expected = -np.linalg.solve(jacobian @ jacobian.T + damping * np.eye(6), jacobian @ residual)
        np.testing.assert_allclose(step, expected, rtol=1e-7)
    assert (np.diff(np.linalg.norm(steps, axis=1)) < 0).all()


def test_steps_do_not_run_away_where_nothing_is_felt() -> None:
    jacobian = np.diag([1.0, 1.0, 0.0])
    step = Quadratic(jacobian @ jacobian.T, jacobian @ np.ones(3)).step(0.1)
    np.testing.assert_allclose(step, [-1 / 1.1, -1 / 1.1, 0.0])


def test_there_is_no_step_where_the_squares_have_no_minimum() -> None:
    np.testing.assert_array_equal(Quadratic(-np.eye(3), np.ones(3)).step(0.1), np.zeros(3))


def test_samples_raise_the_squares_by_as_much_as_asked() -> None:
    jacobian = RNG.normal(size=(20, 60)) * np.logspace(0, 3, 20)[:, None]
    root = Quadratic(jacobian @ jacobian.T, np.zeros(20)).root_covariance(rise=2.0, sigma=1e6)
    samples = RNG.normal(size=(20000, 20)) @ root
    rises = np.sum((samples @ jacobian) ** 2, axis=1)
    assert rises.mean() == pytest.approx(2.0, rel=0.03)
    np.testing.assert_allclose(root, root.T, atol=1e-12)


def test_no_direction_is_sampled_beyond_sigma() -> None:
    root = Quadratic(np.diag([1e-18, 1.0, 1e6]), np.zeros(3)).root_covariance(rise=1.0, sigma=0.2)
    deviations = np.sqrt(np.linalg.eigvalsh(root @ root))
    assert deviations.max() == pytest.approx(0.2, rel=1e-6)
    assert deviations.min() < 1e-3


def test_a_curvature_that_rounding_made_indefinite_is_sampled() -> None:
    curvature = np.diag([2e9, 600.0, 1.0, -560.0])
    root = Quadratic(curvature, np.zeros(4)).root_covariance(rise=3.0, sigma=1.0)
    assert np.isfinite(root).all()
    np.testing.assert_allclose(root[3, 3], 1.0, rtol=1e-12)
