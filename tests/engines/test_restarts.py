"""After a fall that nothing mends, the simulation begins anew further on, with the same bits if killed."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simrecon import replay, schedule
from simrecon.engines import checkpoint, restarts, warm_start
from simrecon.engines import windows as clip
from simrecon.engines.problem import Problem
from simrecon.results import motion_file
from simrecon.sim.state import initial_state, qpos_of, simulate
from simrecon.types import Handover, Window, WindowResult
from tests.engines.conftest import Makers
from tests.engines.test_windows import RETRIES, Scripted

FRAMES = 22
Restart = Callable[[Window], Handover | None]


@pytest.fixture(scope="module")
def problem(make: type[Makers]) -> Problem:
    plan = make.settings(length_s=0.1, corridor_m=0.3, retries=RETRIES)
    return make.clip(plan, make.standing(frames=FRAMES))


def anew(problem: Problem, not_at: tuple[int, ...] = ()) -> Restart:
    def begin(window: Window) -> Handover | None:
        if window.index in not_at:
            return None
        qpos = problem.qpos[window.start_step // problem.clock.stride]
        return Handover(
            initial_state(problem.model, qpos, np.zeros(problem.model.nv)), np.zeros((0, problem.model.nu))
        )

    return begin


def solve(
    problem: Problem,
    falls: dict[int, int],
    restart: Restart | None,
    solved: tuple[WindowResult, ...] = (),
    keep: Callable[[WindowResult], None] | None = None,
) -> tuple[WindowResult, ...]:
    windows = schedule.cut(problem.clock, problem.plan)
    assert len(windows) == 7
    start = warm_start.from_fit(problem)
    return clip.solve(Scripted(problem, falls), windows, start, 7, solved, keep=keep, restart=restart)


def indices(results: tuple[WindowResult, ...]) -> list[int]:
    return [result.window.index for result in results]


def test_the_simulation_begins_anew_after_the_window_that_fell(problem: Problem) -> None:
    found = solve(problem, {2: 99}, anew(problem))
    assert indices(found) == [0, 1, 3, 4, 5, 6]
    assert [result.gap_from for result in found] == [-1, -1, 2, -1, -1, -1]
    assert indices(solve(problem, {2: 99}, None)) == [0, 1]


def test_it_begins_where_the_reference_can_be_simulated(problem: Problem) -> None:
    found = solve(problem, {2: 99, 5: 99}, anew(problem, not_at=(3,)))
    assert indices(found) == [0, 1, 4, 6]
    assert [result.gap_from for result in found] == [-1, -1, 2, 5]
    assert indices(solve(problem, {0: 99}, anew(problem))) == [1, 2, 3, 4, 5, 6]
    assert solve(problem, {0: 99}, anew(problem, not_at=tuple(range(7)))) == ()


def test_retries_go_back_to_the_new_beginning_and_no_further(problem: Problem) -> None:
    found = solve(problem, {1: 99, 4: 2}, anew(problem))
    assert indices(found) == [0, 2, 3, 4, 5, 6]
    assert [result.effort.retry for result in found] == [2, 2, 2, 2, 0, 0]


class KilledError(Exception):
    """The run ends here."""


@pytest.mark.parametrize("after", range(1, 12))
def test_a_run_that_is_killed_goes_on_over_gaps_with_the_same_bits(
    problem: Problem, tmp_path: Path, after: int
) -> None:
    falls, restart = {1: 99, 4: 2, 6: 1}, anew(problem, not_at=(2,))
    whole = solve(problem, falls, restart)
    windows = schedule.cut(problem.clock, problem.plan)
    store = checkpoint.Folder(tmp_path)
    store.restore("a" * 64, windows)
    count = 0

    def keep(result: WindowResult) -> None:
        nonlocal count
        store.save(result)
        count += 1
        if count == after:
            raise KilledError

    with contextlib.suppress(KilledError):
        solve(problem, falls, restart, keep=keep)
    known = tuple(store.restore("a" * 64, windows))
    again = solve(problem, falls, restart, known, store.save)
    assert indices(again) == indices(whole) == [0, 3, 4, 5, 6]
    for one, two in zip(again, whole, strict=True):
        np.testing.assert_array_equal(one.ctrl, two.ctrl)
        np.testing.assert_array_equal(one.states, two.states)
        assert one.gap_from == two.gap_from
    assert indices(tuple(store.restore("a" * 64, windows))) == indices(whole)


def test_a_window_that_is_lost_before_a_gap_is_solved_again(problem: Problem, tmp_path: Path) -> None:
    windows, store = schedule.cut(problem.clock, problem.plan), checkpoint.Folder(tmp_path)
    store.restore("a" * 64, windows)
    solve(problem, {3: 99}, anew(problem), keep=store.save)
    next(tmp_path.rglob("window_00001.npz")).unlink()
    assert indices(tuple(store.restore("a" * 64, windows))) == [0]


def test_a_motion_with_a_gap_replays_to_the_same_bits(make: type[Makers], problem: Problem) -> None:
    fit = make.standing(frames=FRAMES)
    whole = solve(problem, {2: 99}, anew(problem))
    grid = np.arange(FRAMES)
    motion, audit = replay.record(problem, fit, moved(problem, whole), fit.times_s, grid)
    assert audit.replay_exact
    assert motion.restart_step is not None
    begin = whole[2].window.start_step
    assert motion.restart_step.tolist() == [begin]
    inside = (grid * problem.clock.stride > whole[1].window.commit_step) & (
        grid * problem.clock.stride < begin
    )
    np.testing.assert_array_equal(motion.status, inside.astype(int))
    assert (motion.frame_step[inside] == replay.NO_STEP).all()
    assert motion.begins.sum() == 2
    np.testing.assert_array_equal(motion.qpos[motion.begins][1], problem.qpos[begin // problem.clock.stride])
    assert replay.gaps_of(motion)[0][:2] == (whole[1].window.commit_step, begin)


def test_the_file_of_a_motion_with_a_gap_replays_without_knowing_of_it(
    make: type[Makers], problem: Problem, tmp_path: Path
) -> None:
    fit, grid = make.standing(frames=FRAMES), np.arange(FRAMES)
    whole = moved(problem, solve(problem, {2: 99}, anew(problem)))
    motion, _ = replay.record(problem, fit, whole, fit.times_s, grid)
    file = tmp_path / "motion.npz"
    file.write_bytes(motion_file.dumps(motion))
    read = motion_file.read(file)
    for name in ("ctrl", "frame_step", "status", "restart_step", "restart_state"):
        np.testing.assert_array_equal(getattr(read, name), getattr(motion, name))
    arrays = np.load(file)
    first = simulate(problem.model, arrays["state0"], arrays["ctrl"])
    shown = np.flatnonzero(arrays["frame_step"] >= 0)
    assert 0 < len(shown) < (arrays["status"] == 0).sum()
    np.testing.assert_array_equal(
        qpos_of(problem.model, first)[arrays["frame_step"][shown]], arrays["qpos"][shown]
    )


def moved(problem: Problem, windows: tuple[WindowResult, ...]) -> tuple[WindowResult, ...]:
    """The windows as a simulator really goes through them."""
    state, real = windows[0].states[0], []
    for result in windows:
        state = result.states[0] if result.begins_anew else state
        ctrl = problem.targets_rad[result.window.start_step : result.window.commit_step]
        states = simulate(problem.model, state, ctrl)
        real.append(replace(result, ctrl=ctrl, states=states))
        state = states[-1]
    return tuple(real)


def test_nothing_begins_inside_the_floor_in_the_air_or_unseen(make: type[Makers], problem: Problem) -> None:
    fit = make.standing(frames=FRAMES)
    window = schedule.cut(problem.clock, problem.plan)[2]
    begun = restarts.begin(problem, fit, window)
    assert begun is not None
    assert not len(begun.knots_rad)
    assert restarts.begin(problem, replace(fit, interpolated=np.ones(FRAMES, bool)), window) is None
    sunk = problem.qpos.copy()
    sunk[:, 2] -= 0.3
    assert restarts.begin(replace(problem, qpos=sunk), fit, window) is None
    thrown = fit.com_m.copy()
    thrown[:, 2] += 0.5 * 90.0 * fit.times_s**2
    assert restarts.begin(problem, replace(fit, com_m=thrown), window) is None
