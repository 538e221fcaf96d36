"""Descents, and which of several ones goes on."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from simrecon import schedule
from simrecon.engines import warm_start
from simrecon.engines.sampling import descent as descents
from simrecon.engines.sampling import starts
from simrecon.engines.sampling.course import Course
from simrecon.engines.sampling.descent import DAMPINGS, FAILURES, FIRST_DAMPING, RAISE, REST, Descent
from simrecon.engines.sampling.jacobian import Linearised, linearise
from simrecon.engines.sampling.starts import (
    AHEAD,
    DRAWS,
    FIRST_STEPS,
    PATIENCE,
    around,
    descend,
    most_promising,
)
from simrecon.engines.sampling.task import Task
from simrecon.sim.rollout import Simulator
from simrecon.types import Array
from tests.engines.conftest import Makers


@pytest.fixture(scope="module")
def task(make: type[Makers]) -> Task:
    problem = make.clip(make.settings(population=16, start=0.02), make.standing(frames=5))
    (window,) = schedule.cut(problem.clock, problem.plan)
    return Task(problem, window, warm_start.from_fit(problem))


@pytest.fixture(scope="module")
def simulator(task: Task) -> Simulator:
    return Simulator(task.problem.model, 16, 1)


def made_up(loss: float, gain: float, failures: int = 0) -> Descent:
    nothing = cast(Task, None), cast(Simulator, None)
    return Descent(*nothing, np.zeros(1), loss, {"pose": loss}, gain=gain, failures=failures)


def chosen(*losses_and_gains: tuple[float, float]) -> int | None:
    """Which of them is most promising."""
    made = [made_up(*pair) for pair in losses_and_gains]
    found = most_promising(made)
    return None if found is None else [id(one) for one in made].index(id(found))


def test_the_one_that_would_be_lowest_goes_on() -> None:
    assert chosen((1.0, 0.02), (2.0, 0.5)) == 1
    assert chosen((1.0, 0.02), (5.0, 0.1)) == 0
    assert chosen((1.0, 0.5), (2.0, 0.5)) == 0
    # just below, and just above, what the best one has
    catches_up = 1.0 - 0.5 ** (1 / AHEAD)
    best = (1.0, REST / 2)  # at rest
    assert chosen(best, (2.0, catches_up + 1e-6)) == 1
    assert chosen(best, (2.0, catches_up - 1e-6)) is None


def test_none_goes_on_that_is_at_rest_or_diverged() -> None:
    assert chosen((1.0, REST / 2)) is None
    assert chosen((np.inf, 1.0)) is None
    assert chosen((np.inf, 1.0), (3.0, 0.5)) == 1
    assert most_promising([made_up(1.0, 0.0, FAILURES)]) is None
    failed = made_up(1.0, 0.0, FAILURES - 1)
    assert most_promising([failed, made_up(5.0, 0.1)]) is failed  # the best one may try once more
    assert most_promising([made_up(0.9, 0.0, FAILURES), failed]) is None


@pytest.mark.parametrize(
    ("loss", "gain", "failures", "rests"),
    [
        (1.0, 1.0, 0, False),
        (1.0, REST, 0, False),
        (1.0, 0.99 * REST, 0, True),
        (1.0, 0.0, 1, False),
        (1.0, 0.0, FAILURES, True),
        (np.inf, 1.0, 0, True),
    ],
)
def test_a_descent_rests(loss: float, gain: float, failures: int, rests: bool) -> None:
    assert made_up(loss, gain, failures).at_rest is rests


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> list[Array]:
    """Where the slope was measured."""
    points = list[Array]()

    def counted(task: Task, simulator: Simulator, x: Array, scale: Array) -> Linearised:
        points.append(x.copy())
        return linearise(task, simulator, x, scale)

    monkeypatch.setattr(descents, "linearise", counted)
    return points


def test_the_slope_is_measured_once_at_each_point(
    task: Task, simulator: Simulator, measured: list[Array]
) -> None:
    descent = Descent.begin(task, simulator, task.warm_start()[None])
    before = descent.loss
    descent.step()
    assert descent.loss < before
    assert descent.gain == pytest.approx(1 - descent.loss / before)
    assert descent.loss == pytest.approx(sum(descent.terms.values()))
    assert descent.evaluations == 1 + 1 + len(DAMPINGS)
    descent.step()
    assert len(measured) == 2
    assert not np.array_equal(measured[0], measured[1])
    again = Descent.begin(task, simulator, descent.x[None])
    assert again.loss == pytest.approx(descent.loss, rel=1e-12)


def test_no_slope_is_measured_where_no_step_was_taken(
    task: Task, simulator: Simulator, measured: list[Array], monkeypatch: pytest.MonkeyPatch
) -> None:
    descent = Descent.begin(task, simulator, task.warm_start()[None])
    loss, x = descent.loss, descent.x.copy()
    evaluate = task.evaluate

    def uphill(_: Simulator, samples: Array) -> tuple[dict[str, Array], NDArray[np.bool_]]:
        return {"pose": np.full(len(samples), 2 * loss)}, np.ones(len(samples), np.bool_)

    monkeypatch.setattr(task, "evaluate", uphill)
    for failures in range(1, FAILURES + 1):
        descent.step()
        assert (descent.failures, descent.gain, len(measured)) == (failures, 0.0, 1)
        assert descent.damping == pytest.approx(FIRST_DAMPING * RAISE**failures)
    assert descent.at_rest
    spent = descent.evaluations
    descent.step()
    assert (descent.evaluations, descent.loss, len(measured)) == (spent, loss, 1)
    np.testing.assert_array_equal(descent.x, x)
    # one that may go on, and does, measures again only after that
    descent = replace(descent, failures=1, damping=FIRST_DAMPING)
    monkeypatch.setattr(task, "evaluate", evaluate)
    descent.step()
    assert (descent.failures, len(measured)) == (0, 1)
    descent.step()
    assert len(measured) == 2


def test_a_descent_that_begins_nowhere_takes_no_step(
    task: Task, simulator: Simulator, measured: list[Array]
) -> None:
    wild = task.warm_start()
    wild[-1] = np.nan
    descent = Descent.begin(task, simulator, wild[None])
    descent.step()
    assert (descent.loss, descent.terms, descent.evaluations, measured) == (np.inf, {}, 1, [])


def test_starts_are_the_warm_one_and_others_within_bounds(task: Task) -> None:
    found = starts.starts(task, 4, np.random.default_rng(0))
    assert len(found) == 4
    np.testing.assert_array_equal(found[0], task.warm_start()[None])
    low, high = task.bounds().T
    for one, size in zip(found[1:], (starts.NOISE * 2)[:3], strict=True):
        assert ((low <= one) & (one <= high)).all()
        assert one.shape == (DRAWS, len(low))
        assert np.std((one - found[0]) / task.deviations()) == pytest.approx(size, rel=0.15)
    assert len(starts.starts(task, 1, np.random.default_rng(0))) == 1


def test_a_descent_begins_at_the_best_of_its_draws(task: Task, simulator: Simulator) -> None:
    draws = starts.starts(task, 2, np.random.default_rng(0))[1]
    values, finite = task.evaluate(simulator, draws)
    total = np.where(finite, sum(values.values()), np.inf)
    descent = Descent.begin(task, simulator, draws)
    np.testing.assert_array_equal(descent.x, draws[np.argmin(total)])
    assert descent.loss == total.min() < np.median(total)
    assert descent.evaluations == DRAWS


def test_draws_about_an_end_are_wide_where_the_loss_is_flat(task: Task, simulator: Simulator) -> None:
    descent = Descent.begin(task, simulator, task.warm_start()[None])
    unshaped = around(descent, np.random.default_rng(0)) - descent.x
    for _ in range(3):
        descent.step()
    shaped = around(descent, np.random.default_rng(0)) - descent.x
    assert unshaped.shape == shaped.shape == (DRAWS, len(descent.x))

    def risen(moves: Array) -> float:
        values, finite = task.evaluate(simulator, descent.x + moves)
        return float(np.median(np.where(finite, sum(values.values()), np.inf))) - descent.loss

    same_length = unshaped * np.linalg.norm(shaped) / np.linalg.norm(unshaped)
    assert 0 < risen(shaped) < 0.5 * risen(same_length)


def test_descents_stop_where_a_plan_ignores_what_they_gain(task: Task) -> None:
    _, all_steps = descended(task, 2, 30)
    optimiser = replace(task.problem.plan.optimiser, tol_loss=0.9)
    problem = replace(task.problem, plan=replace(task.problem.plan, optimiser=optimiser))
    _, few = descended(Task(problem, task.window, task.handover), 2, 30)
    assert len(few.losses) - 1 >= max(PATIENCE, 2 * FIRST_STEPS + 1)
    assert len(few.losses) < len(all_steps.losses)
    assert few.losses == all_steps.losses[: len(few.losses)]


def descended(task: Task, count: int, steps: int, threads: int = 1) -> tuple[Descent, Course]:
    course, simulator = Course(), Simulator(task.problem.model, 16, threads)
    return descend(task, simulator, np.random.default_rng(0), count, steps, course), course


def test_several_starts_are_at_least_as_good_as_one(task: Task) -> None:
    one, _ = descended(task, 1, 3)
    several, course = descended(task, 3, 9)
    assert several.loss <= one.loss
    assert (np.diff(course.losses) <= 0).all()
    assert (np.diff(course.steps) >= 0).all()
    assert course.losses[-1] == several.loss


@pytest.mark.parametrize(("count", "steps"), [(3, 0), (1, 2), (3, 4), (2, 6)])
def test_no_more_steps_are_taken_than_told(
    task: Task, count: int, steps: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, stepped, begin, step = list[int](), list[int](), Descent.begin, Descent.step

    def beginning(task: Task, simulator: Simulator, x: Array) -> Descent:
        begun.append(id(x))
        return begin(task, simulator, x)

    def stepping(descent: Descent) -> None:
        stepped.append(id(descent))
        step(descent)

    monkeypatch.setattr(Descent, "begin", beginning)
    monkeypatch.setattr(Descent, "step", stepping)
    _, course = descended(task, count, steps)
    assert len(begun) == (count if steps else 1)
    assert len(course.losses) == 1 + len(stepped)
    assert len(stepped) <= steps
    first = stepped[: count * FIRST_STEPS]
    assert {first.count(own) for own in first} <= {FIRST_STEPS}
    assert len(stepped) >= min(steps, count * FIRST_STEPS)


def test_the_seed_says_all_and_the_number_of_threads_nothing(task: Task) -> None:
    one, two = (descended(task, 2, 4, threads) for threads in (1, 2))
    np.testing.assert_array_equal(one[0].x, two[0].x)
    assert one[0].terms == two[0].terms
    assert one[1] == two[1]
    same, again, other = (starts.starts(task, 2, np.random.default_rng(seed))[1] for seed in (0, 0, 1))
    np.testing.assert_array_equal(same, again)
    assert not np.array_equal(same, other)
