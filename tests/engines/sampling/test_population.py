"""Draws about the end of a search, and what they say of forces and contacts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import schedule
from simrecon.engines import checkpoint, warm_start
from simrecon.engines.sampling.jacobian import linearise
from simrecon.engines.sampling.population import Population
from simrecon.engines.sampling.task import Task
from simrecon.optim.gauss_newton import Quadratic
from simrecon.sim.rollout import Simulator
from simrecon.types import Array, Spread, Window
from tests.engines.conftest import Makers
from tests.support.window_results import solved

DRAWS = 6


@pytest.fixture(scope="module")
def task(make: type[Makers]) -> Task:
    problem = make.clip(make.settings(population=16), make.standing(frames=7))
    optimiser = replace(problem.plan.optimiser, draws=DRAWS)
    problem = replace(problem, plan=replace(problem.plan, optimiser=optimiser))
    (window,) = schedule.cut(problem.clock, problem.plan)
    return Task(problem, window, warm_start.from_fit(problem))


@pytest.fixture(scope="module")
def found(task: Task) -> tuple[Array, Quadratic]:
    """Where a search may have ended, and the loss there."""
    x = task.warm_start()
    slopes = linearise(task, Simulator(task.problem.model, 16, 1), x, task.deviations())
    return x, Quadratic(slopes.curvature, slopes.gradient)


def spread(task: Task, found: Any, threads: int = 1, quadratic: Quadratic | None = None) -> Any:
    simulator = Simulator(task.problem.model, 16, threads)
    x, own = found
    population = Population(task.problem, threads)
    return population.spread(task, simulator, x, quadratic or own, np.random.default_rng(3))


def test_the_bits_are_the_same_with_any_number_of_threads(task: Task, found: Any) -> None:
    one, two = spread(task, found, 1), spread(task, found, 2)
    np.testing.assert_array_equal(one.force_N, two.force_N)
    np.testing.assert_array_equal(one.touch, two.touch)


def test_who_stands_is_pushed_at_the_feet_alone(task: Task, found: Any) -> None:
    known = spread(task, found)
    stride = task.problem.clock.stride
    frames = (task.window.commit_step - task.window.start_step) // stride
    assert known.force_N.shape == (frames, 3, 3)
    model = task.problem.model
    names = [model.geom(row).name for row in np.flatnonzero(model.geom_bodyid > 0)]
    assert known.touch.shape == (frames, len(names))
    feet = [names.index(f"{side}_foot") for side in ("left", "right")]
    assert known.touch[-1, feet].min() > 0.5
    assert np.delete(known.touch, feet, axis=1).max() == 0.0
    assert 0.0 < known.force_N[1:, :, 2].max() < 9.81 * 70.0
    assert known.touch.max() <= 1.0 + 1e-12


def test_a_loss_that_allows_nothing_else_has_no_spread(task: Task, found: Any) -> None:
    x, _ = found
    stiff = Quadratic(1e14 * np.eye(len(x)), np.zeros(len(x)))
    assert spread(task, found, quadratic=stiff).force_N.max() < 1.0
    assert spread(task, found).force_N.max() > 1.0


def test_a_checkpoint_keeps_it(tmp_path: Path) -> None:
    window, known = Window(0, 0, 4, 8), Spread(np.full((2, 3, 3), 7.0), np.full((2, 5), 0.25))
    states = np.zeros((5, 3))
    store = checkpoint.Folder(tmp_path)
    for kept, index in ((known, 0), (None, 1)):
        own = replace(window, index=index)
        store.restore("d" * 64, [replace(window, index=row) for row in range(index + 1)])
        store.save(solved(own, np.zeros((4, 2)), states, spread=kept))
    first, second = checkpoint.Folder(tmp_path).restore("d" * 64, [window, replace(window, index=1)])
    assert first.spread is not None
    np.testing.assert_array_equal(first.spread.force_N, known.force_N)
    np.testing.assert_array_equal(first.spread.touch, known.touch)
    assert second.spread is None
