"""Windows drafted by themselves: same bits on any number of threads, a better start, only knots."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon import schedule
from simrecon.engines.problem import Problem
from simrecon.engines.sampling import draft
from simrecon.engines.sampling import search as sampling
from simrecon.engines.sampling.task import Task


@pytest.fixture(scope="module")
def problem(make) -> Problem:
    return make.clip(make.settings(length_s=0.2, overlap_s=0.1, population=16, draft=1))


def test_no_draft_is_the_plain_start(make) -> None:
    problem = make.clip(make.settings(length_s=0.2, overlap_s=0.1))
    start = sampling.start(problem)
    assert draft.drafted(problem, schedule.cut(problem.clock, problem.plan), start) is problem


def test_the_number_of_threads_does_not_matter(problem: Problem) -> None:
    windows, start = schedule.cut(problem.clock, problem.plan), sampling.start(problem)
    one, two = (draft.drafted(problem, windows, start, threads) for threads in (1, 2))
    np.testing.assert_array_equal(one.draft_rad, two.draft_rad)
    assert 1e-3 < np.abs(one.draft_rad).max() <= problem.plan.optimiser.bound_rad


def test_a_window_starts_from_its_draft(problem: Problem) -> None:
    windows, start = schedule.cut(problem.clock, problem.plan), sampling.start(problem)
    found = draft.drafted(problem, windows, start, 1)
    losses = []
    for given in (problem, found):
        task = Task(given, windows[0], start)
        simulator = sampling.Sampler(problem, 1).simulator
        terms, _ = task.evaluate(simulator, task.warm_start()[None])
        losses.append(float(sum(terms.values())[0]))
    assert losses[1] < losses[0]
    later = Task(found, windows[1], start)
    knots = later.warm_start()[: later.shape[0] * later.shape[1]].reshape(later.shape)
    np.testing.assert_array_equal(knots, found.draft_rad[later.knots])
