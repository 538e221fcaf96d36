"""Windows drafted by themselves: same bits on any number of threads, a better start, only knots."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon import schedule
from simrecon.engines import warm_start
from simrecon.engines.problem import Problem
from simrecon.engines.sampling import draft
from simrecon.engines.sampling.sampler import Sampler
from simrecon.engines.sampling.task import Task
from tests.engines.conftest import Makers


@pytest.fixture(scope="module")
def problem(make: type[Makers]) -> Problem:
    return make.clip(make.settings(length_s=0.2, overlap_s=0.1, population=16, draft=1))


def test_no_draft_is_the_plain_start(make: type[Makers]) -> None:
    problem = make.clip(make.settings(length_s=0.2, overlap_s=0.1))
    start = warm_start.from_fit(problem)
    assert draft.drafted(problem, schedule.cut(problem.clock, problem.plan), start) is problem


def test_the_number_of_threads_does_not_matter(problem: Problem) -> None:
    windows, start = schedule.cut(problem.clock, problem.plan), warm_start.from_fit(problem)
    one, two = (draft.drafted(problem, windows, start, threads) for threads in (1, 2))
    np.testing.assert_array_equal(one.draft_rad, two.draft_rad)
    assert 1e-3 < np.abs(one.draft_rad).max() <= problem.plan.optimiser.bound_rad


def test_a_window_starts_from_its_draft(problem: Problem) -> None:
    windows, start = schedule.cut(problem.clock, problem.plan), warm_start.from_fit(problem)
    after = draft.drafted(problem, windows, start, 1)
    losses = []
    for one in (problem, after):
        task = Task(one, windows[0], start)
        simulator = Sampler(problem, 1).simulator
        terms, _ = task.evaluate(simulator, task.warm_start()[None])
        losses.append(float(sum(terms.values(), np.zeros(1))[0]))
    assert losses[1] < losses[0]
    later = Task(after, windows[1], start)
    knots = later.knots_of(later.warm_start())
    np.testing.assert_array_equal(knots, after.draft_rad[later.knots])


def test_the_sampler_prepares_with_a_draft(problem: Problem) -> None:
    windows, start = schedule.cut(problem.clock, problem.plan), warm_start.from_fit(problem)
    sampler = Sampler(problem, 1)
    sampler.prepare(windows, start)
    np.testing.assert_array_equal(
        sampler.problem.draft_rad, draft.drafted(problem, windows, start, 1).draft_rad
    )
    assert not problem.draft_rad.any()
