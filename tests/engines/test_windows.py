"""Windows in a row: a fall goes back, with more effort each time, and a run that goes on ends the same."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from simrecon import schedule
from simrecon.engines import warm_start
from simrecon.engines import windows as clip
from simrecon.engines.problem import Problem
from simrecon.sim.state import initial_state, qpos_of
from simrecon.types import Effort, Handover, Window, WindowResult, WindowStatus
from tests.engines.conftest import Makers
from tests.support.window_results import solved

RETRIES = 2


@pytest.fixture(scope="module")
def problem(make: type[Makers]) -> Problem:
    plan = make.settings(length_s=0.1, corridor_m=0.3, retries=RETRIES)
    return make.clip(plan)


class Scripted:
    """A tracker that stands still, and falls where it is told to: {window: retries below which it falls}."""

    def __init__(self, problem: Problem, falls: dict[int, int]) -> None:
        self.problem, self.falls = problem, falls
        self.calls: list[tuple[int, int]] = []
        self.draws: list[float] = []

    def prepare(self, _windows: Sequence[Window], _start: Handover) -> None:
        raise AssertionError("the windows are not prepared by who solves them")

    def solve(
        self, window: Window, handover: Handover, rng: np.random.Generator, effort: Effort
    ) -> WindowResult:
        self.calls.append((window.index, effort.retry))
        self.draws.append(float(rng.random()))
        model, stride = self.problem.model, self.problem.clock.stride
        frames = np.arange(window.start_step, window.commit_step + 1) // stride
        down = np.array([0.0, 0.0, 0.4 * (effort.retry < self.falls.get(window.index, 0))])
        states = np.stack([initial_state(model, q, np.zeros(model.nv)) for q in self.problem.qpos[frames]])
        qpos_of(model, states)[:, :3] -= down
        return solved(
            window,
            np.full((window.commit_step - window.start_step, model.nu), self.draws[-1]),
            states,
            effort=effort,
            handover=Handover(states[-1], handover.knots_rad),
        )


def solve(
    tracker: Scripted, solved: tuple[WindowResult, ...] = ()
) -> tuple[tuple[WindowResult, ...], list[int]]:
    kept: list[int] = []
    windows = schedule.cut(tracker.problem.clock, tracker.problem.plan)
    results = clip.solve(
        tracker,
        windows,
        warm_start.from_fit(tracker.problem),
        7,
        solved=solved,
        keep=lambda result: kept.append(result.window.index),
    )
    return results, kept


def test_without_a_fall_every_window_is_solved_once(problem: Problem) -> None:
    tracker = Scripted(problem, {})
    results, kept = solve(tracker)
    assert tracker.calls == [(0, 0), (1, 0), (2, 0), (3, 0)]
    assert kept == [result.window.index for result in results] == [0, 1, 2, 3]
    assert len(set(tracker.draws)) == 4


def test_a_fall_goes_back_one_window_and_then_two(problem: Problem) -> None:
    tracker = Scripted(problem, {2: 2})
    results, _ = solve(tracker)
    tries = [(0, 0), (1, 0), (2, 0), (1, 1), (2, 1), (0, 2), (1, 2), (2, 2), (3, 0)]
    assert tracker.calls == tries
    assert [result.effort.retry for result in results] == [2, 2, 2, 0]
    assert len(set(tracker.draws)) == len(tries)  # other random numbers each time
    assert [Effort(retry, 2).factor for retry in range(3)] == [1, 2, 4]


def test_a_fall_that_no_retry_mends_ends_the_clip(problem: Problem) -> None:
    tracker = Scripted(problem, {1: RETRIES + 1})
    results, kept = solve(tracker)
    assert [result.window.index for result in results] == [0]
    assert tracker.calls[-1] == (1, RETRIES)
    assert 1 not in kept


def test_what_was_solved_before_a_retry_is_not_lost_by_it(problem: Problem) -> None:
    class Unlucky(Scripted):
        def solve(
            self, window: Window, handover: Handover, rng: np.random.Generator, effort: Effort
        ) -> WindowResult:
            self.falls = {3: RETRIES + 1} | ({1: RETRIES + 1} if effort.retry == RETRIES else {})
            return super().solve(window, handover, rng, effort)

    plain, _ = solve(Scripted(problem, {}))
    results, _ = solve(Unlucky(problem, {}))
    assert [(result.window.index, result.effort.retry) for result in results] == [(0, 0), (1, 0), (2, 0)]
    for one, two in zip(results, plain, strict=False):
        np.testing.assert_array_equal(one.ctrl, two.ctrl)


def test_a_window_that_failed_has_fallen_whatever_the_corridor(problem: Problem) -> None:
    tracker = Scripted(problem, {})
    window = schedule.cut(problem.clock, problem.plan)[0]
    result = tracker.solve(window, warm_start.from_fit(problem), np.random.default_rng(0), Effort())
    wide = replace(
        problem, plan=replace(problem.plan, recovery=replace(problem.plan.recovery, corridor_m=0.0))
    )
    assert not clip.fell(problem, result)
    assert clip.fell(wide, replace(result, status=WindowStatus.FAILED))


def test_any_corridor_is_left_by_who_lies_down(problem: Problem) -> None:
    tracker = Scripted(problem, {0: 1})
    window = schedule.cut(problem.clock, problem.plan)[0]
    result = tracker.solve(window, warm_start.from_fit(problem), np.random.default_rng(0), Effort())
    assert clip.fell(problem, result)
    without = replace(problem.plan, recovery=replace(problem.plan.recovery, corridor_m=0.0))
    assert not clip.fell(replace(problem, plan=without), result)


def killed(tracker: Scripted, known: int) -> tuple[WindowResult, ...]:
    """What a checkpoint holds of a run that was killed after so many windows were kept."""
    state: list[WindowResult] = []
    left = [known]

    class KilledError(Exception):
        pass

    def keep(result: WindowResult) -> None:
        del state[result.window.index :]
        state.append(result)
        left[0] -= 1
        if not left[0]:
            raise KilledError

    if known:
        windows = schedule.cut(tracker.problem.clock, tracker.problem.plan)
        with pytest.raises(KilledError):
            clip.solve(tracker, windows, warm_start.from_fit(tracker.problem), 7, keep=keep)
    return tuple(state)


def check_it_goes_on(make: Callable[[], Scripted], known: int) -> None:
    whole, kept = solve(make())
    assert known <= len(kept)
    again, _ = solve(make(), killed(make(), known))
    assert [r.window.index for r in again] == [r.window.index for r in whole]
    assert [r.effort for r in again] == [r.effort for r in whole]
    for one, two in zip(again, whole, strict=True):
        np.testing.assert_array_equal(one.ctrl, two.ctrl)


@pytest.mark.parametrize("known", range(9))
def test_who_goes_on_at_any_moment_ends_with_the_same(problem: Problem, known: int) -> None:
    check_it_goes_on(lambda: Scripted(problem, {1: 1, 2: 2}), known)


class Costly(Scripted):
    """Losses by window and draw: {(window, again): loss}, 1 where nothing is said."""

    def __init__(self, problem: Problem, losses: dict[tuple[int, int], float]) -> None:
        doubting = replace(problem.plan.recovery, doubt=2.0, doubt_loss=10.0)
        super().__init__(replace(problem, plan=replace(problem.plan, recovery=doubting)), {})
        self.losses = losses

    def solve(
        self, window: Window, handover: Handover, rng: np.random.Generator, effort: Effort
    ) -> WindowResult:
        result = super().solve(window, handover, rng, effort)
        self.calls[-1] = (window.index, effort.again)
        return replace(result, loss=self.losses.get(self.calls[-1], 1.0))


@pytest.mark.parametrize(
    ("losses", "calls", "stands"),
    [
        ({(1, 0): 9.0}, [(0, 0), (1, 0), (2, 0), (3, 0)], [0, 0, 0, 0]),  # too little to be in doubt
        ({(0, 0): 30.0, (1, 0): 50.0}, [(0, 0), (1, 0), (2, 0), (3, 0)], [0, 0, 0, 0]),  # not steep
        ({(1, 0): 50.0, (1, 1): 9.0}, [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (3, 0)], [1, 1, 0, 0]),
        ({(1, 0): 50.0, (0, 1): 99.0}, [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (3, 0)], [0, 0, 0, 0]),
        # what was solved again isn't in doubt once more, but what follows may be
        (
            {(1, 0): 50.0, (1, 1): 40.0, (2, 0): 90.0, (1, 2): 30.0, (2, 2): 20.0},
            [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (1, 2), (2, 2), (3, 0)],
            [1, 2, 2, 0],
        ),
    ],
)
def test_a_loss_that_rises_steeply_has_the_last_two_windows_solved_again(
    problem: Problem, losses: dict[tuple[int, int], float], calls: list[tuple[int, int]], stands: list[int]
) -> None:
    tracker = Costly(problem, losses)
    results, _ = solve(tracker)
    assert tracker.calls == calls
    assert [result.effort.again for result in results] == stands
    assert len(set(tracker.draws)) == len(calls)  # other random numbers each time


@pytest.mark.parametrize("known", range(7))
def test_who_goes_on_after_a_doubt_ends_with_the_same(problem: Problem, known: int) -> None:
    losses = {(1, 0): 50.0, (1, 1): 40.0, (2, 0): 90.0, (1, 2): 30.0, (2, 2): 20.0}
    check_it_goes_on(lambda: Costly(problem, losses), known)
