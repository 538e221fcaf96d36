"""L-BFGS: known minima, limits, losses that are not finite, exceptions."""

from __future__ import annotations

import math
import time
import traceback

import numpy as np
import pytest

from simrecon.optim.lbfgs import Status, minimize
from simrecon.types import Array


def rosenbrock(x: Array) -> tuple[float, Array]:
    valley = x[1:] - x[:-1] ** 2
    gradient = np.zeros_like(x)
    gradient[:-1] = -400 * x[:-1] * valley - 2 * (1 - x[:-1])
    gradient[1:] += 200 * valley
    return float((100 * valley**2 + (1 - x[:-1]) ** 2).sum()), gradient


class Quadratic:
    """offset + unit · ½ Σ w (x - target)²."""

    def __init__(self, n: int, condition: float, offset: float = 1.0, unit: float = 1.0) -> None:
        self.weights = np.geomspace(1.0, condition, n)
        self.target = np.linspace(-1.0, 2.0, n)
        self.offset = offset
        self.unit = unit

    def __call__(self, x: Array) -> tuple[float, Array]:
        slope = self.weights * (x - self.target)
        return self.offset + self.unit * 0.5 * float(slope @ (x - self.target)), self.unit * slope


@pytest.mark.parametrize("n", [2, 10, 30])
def test_rosenbrock_minimum_is_found(n: int) -> None:
    least = minimize(rosenbrock, np.tile([-1.2, 1.0], n // 2), max_evaluations=1000, ftol_rel=1e-14)
    assert least.status is Status.CONVERGED
    np.testing.assert_allclose(least.x, 1.0, atol=1e-6)
    assert least.loss == rosenbrock(least.x)[0]


def test_quadratic_of_two_thousand_variables() -> None:
    problem = Quadratic(2000, 1e3)
    least = minimize(problem, np.zeros(2000), max_evaluations=2000, ftol_rel=1e-14)
    assert least.status is Status.CONVERGED
    np.testing.assert_allclose(least.x, problem.target, atol=1e-4)


def test_forty_five_thousand_variables_are_fast() -> None:
    problem = Quadratic(45_000, 10.0)
    begin = time.perf_counter()
    least = minimize(problem, np.zeros(45_000), max_evaluations=500, ftol_rel=1e-12)
    assert time.perf_counter() - begin < 5.0
    np.testing.assert_allclose(least.x, problem.target, atol=1e-3)


def test_looser_tolerance_stops_earlier() -> None:
    problem = Quadratic(200, 1e4)
    loose, tight = (
        minimize(problem, np.zeros(200), max_evaluations=5000, ftol_rel=tol) for tol in (1e-3, 1e-12)
    )
    assert loose.status is tight.status is Status.CONVERGED
    assert loose.evaluations < tight.evaluations
    assert loose.loss > tight.loss


@pytest.mark.parametrize("unit", [1e-14, 1e-3, 1.0, 1e6, 1e20])
def test_unit_of_the_loss_does_not_matter(unit: float) -> None:
    problem = Quadratic(50, 100.0, offset=0.0, unit=unit)
    least = minimize(problem, np.zeros(50), max_evaluations=500, ftol_rel=1e-12)
    np.testing.assert_allclose(least.x, problem.target, atol=1e-4)


def test_evaluation_limit_is_kept_and_the_trace_descends() -> None:
    calls = 0

    def counted(x: Array) -> tuple[float, Array]:
        nonlocal calls
        calls += 1
        return rosenbrock(x)

    least = minimize(counted, np.tile([-1.2, 1.0], 50), max_evaluations=23, ftol_rel=0.0)
    assert calls == least.evaluations == least.trace.size == 23
    assert least.status is Status.EVALUATIONS
    assert (np.diff(least.trace) <= 0).all()
    assert least.trace[-1] == least.loss < least.trace[0]


def test_evaluation_limit_is_kept_inside_a_line_search() -> None:
    def wall(x: Array) -> tuple[float, Array]:
        return (math.nan, x) if (x > 2).any() else (float(((x - 3) ** 2).sum()), 2 * (x - 3))

    least = minimize(wall, np.zeros(4), max_evaluations=200, ftol_rel=1e-12)
    assert least.evaluations <= 200
    assert least.status in (Status.EVALUATIONS, Status.STALLED)
    np.testing.assert_allclose(least.x, 2.0, atol=1e-2)


@pytest.mark.parametrize("start", [0.01, 100.0, 1e4])
def test_search_backs_off_from_a_nan_region(start: float) -> None:
    target = np.arange(1.0, 6.0)
    seen_nan = False

    def barrier(x: Array) -> tuple[float, Array]:
        nonlocal seen_nan
        with np.errstate(invalid="ignore", divide="ignore"):
            loss = float((x - target * np.log(x)).sum())
        seen_nan |= math.isnan(loss)
        return loss, 1 - target / x

    least = minimize(barrier, np.full(5, start), max_evaluations=1000, ftol_rel=1e-13)
    assert seen_nan or start < 1
    assert least.status is Status.CONVERGED
    np.testing.assert_allclose(least.x, target, rtol=1e-5)


def test_nan_gradient_is_never_accepted() -> None:
    def hole(x: Array) -> tuple[float, Array]:
        gradient = 2 * (x - 2)
        return float(((x - 2) ** 2).sum()), np.where(x > 1.5, math.nan, gradient)

    least = minimize(hole, np.zeros(3), max_evaluations=100, ftol_rel=1e-12)
    assert (least.x <= 1.5).all()
    assert least.loss == hole(least.x)[0] < 12.0


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_start_without_a_finite_loss_fails_at_once(bad: float) -> None:
    start = np.array([1.0, 2.0])
    least = minimize(lambda x: (bad, x), start, max_evaluations=50, ftol_rel=0.0)
    assert least.status is Status.FAILED
    assert least.evaluations == 1
    assert least.loss == math.inf
    np.testing.assert_array_equal(least.x, start)


def test_wrong_gradient_is_not_called_converged() -> None:
    least = minimize(lambda x: (float(x @ x), -2 * x), np.ones(3), max_evaluations=100, ftol_rel=1e-9)
    assert least.status is Status.STALLED
    np.testing.assert_array_equal(least.x, np.ones(3))


def test_start_at_the_minimum() -> None:
    problem = Quadratic(5, 10.0)
    least = minimize(problem, problem.target, max_evaluations=50, ftol_rel=1e-12)
    assert least.status is Status.CONVERGED
    np.testing.assert_array_equal(least.x, problem.target)


@pytest.mark.parametrize("error", [KeyError("pose"), RuntimeError(""), KeyboardInterrupt()])
def test_exception_passes_through_with_its_traceback(error: BaseException) -> None:
    calls = 0

    def fails_third(x: Array) -> tuple[float, Array]:
        nonlocal calls
        calls += 1
        if calls == 3:
            raise error
        return rosenbrock(x)

    with pytest.raises(type(error)) as caught:
        minimize(fails_third, np.array([-1.2, 1.0]), max_evaluations=100, ftol_rel=0.0)
    assert caught.value is error
    assert "fails_third" in [frame.name for frame in traceback.extract_tb(caught.value.__traceback__)]
    assert calls == 3


def test_bounds_hold_and_bind() -> None:
    problem = Quadratic(20, 10.0)
    lower = np.full(20, -0.5)
    inside = True

    def watched(x: Array) -> tuple[float, Array]:
        nonlocal inside
        inside &= bool((lower <= x).all())
        return problem(x)

    least = minimize(watched, np.zeros(20), max_evaluations=2000, ftol_rel=1e-14, lower=lower)
    assert inside
    np.testing.assert_allclose(least.x, np.maximum(problem.target, lower), atol=1e-5)


def test_objective_may_keep_and_change_its_argument() -> None:
    def changes(x: Array) -> tuple[float, Array]:
        result = rosenbrock(x.copy())
        x[:] = math.nan
        return result

    start = np.array([-1.2, 1.0])
    least = minimize(changes, start, max_evaluations=200, ftol_rel=1e-14)
    np.testing.assert_allclose(least.x, 1.0, atol=1e-6)
    np.testing.assert_array_equal(start, [-1.2, 1.0])


@pytest.mark.parametrize(
    ("start", "options", "what"),
    [
        (np.zeros((2, 2)), {}, "x0"),
        (np.array([0.0, math.nan]), {}, "x0"),
        (np.zeros(2), {"lower": np.ones(2)}, "below the bounds"),
        (np.zeros(2), {"lower": np.zeros(3)}, "lower: shape"),
        (np.zeros(2), {"lower": np.array([0.0, math.nan])}, "lower"),
        (np.zeros(2), {"max_evaluations": 0}, "max_evaluations 0"),
        (np.zeros(2), {"ftol_rel": -1.0}, "ftol_rel -1"),
    ],
)
def test_bad_arguments_are_named(start: Array, options: dict[str, object], what: str) -> None:
    arguments: dict[str, object] = {"max_evaluations": 10, "ftol_rel": 0.0, **options}
    with pytest.raises(ValueError, match=what):
        minimize(rosenbrock, start, **arguments)  # type: ignore[arg-type]


def test_gradient_of_the_wrong_shape_is_named() -> None:
    with pytest.raises(ValueError, match="gradient"):
        minimize(lambda x: (float(x @ x), np.ones(1)), np.zeros(2), max_evaluations=10, ftol_rel=0.0)
