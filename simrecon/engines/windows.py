"""All windows of a clip in a row, and once more from further back after a fall.

A window has fallen if its committed part leaves the plan's corridor around the kinematic fit, or if no
rollout stayed finite. The first retry goes back one window, the next one two, and so on, each with twice the
effort of the one before and other random numbers, up to the window that fell. If the plan's retries do not
help either, the clip ends there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from simrecon.engines import Tracker
from simrecon.engines.problem import Problem
from simrecon.observer import SILENT, Observer
from simrecon.sim.poses import posed
from simrecon.sim.state import qpos_of
from simrecon.system import blas
from simrecon.types import Effort, Handover, Window, WindowResult, WindowStatus


@blas.one_thread()
def solve(
    tracker: Tracker,
    windows: Sequence[Window],
    start: Handover,
    seed: int,
    solved: Sequence[WindowResult] = (),
    observer: Observer = SILENT,
    keep: Callable[[WindowResult], None] | None = None,
) -> tuple[WindowResult, ...]:
    """Solve the windows of a clip in order.

    A window depends on the seed, on what was handed over, and on its effort alone; so a run that goes on from
    `solved` ends with the bits of one that was never interrupted.

    Args:
        tracker: solves one window.
        windows: of the clip.
        start: where the first window begins.
        seed: of all random numbers.
        solved: the first windows, if they are known already.
        observer: hears how far the simulation is, and of each window that did not fall.
        keep: called with the same windows, before the observer; None: they are not kept.

    Returns:
        The windows up to the end, or up to the first one that fell in spite of all retries.
    """
    results, end = list(solved), len(windows)
    clock = tracker.problem.clock
    effort = results[-1].effort if results else Effort()
    while len(results) < end:
        window = windows[len(results)]
        if effort.until < window.index:
            effort = Effort(0, window.index)
        observer.stage("simulation", window.start_step * clock.step_s, clock.duration_s)
        handover = results[-1].handover if results else start
        rng = np.random.default_rng([seed, window.index, effort.retry])
        result = tracker.solve(window, handover, rng, effort)
        if not fell(tracker.problem, result):
            results.append(result)
            if keep is not None:
                keep(result)
            observer.solved(result, windows)
        elif effort.retry < tracker.problem.plan.recovery.retries:
            effort = Effort(effort.retry + 1, effort.until)
            del results[_back(effort, window) :]
        elif window.index == effort.until:
            break
        else:  # what the retries lost is solved again as it was at first, and the clip ends where it fell
            end = effort.until
            del results[_back(effort, window) :]
            effort = Effort()
    observer.stage("simulation", clock.duration_s, clock.duration_s)
    return tuple(results)


def _back(effort: Effort, window: Window) -> int:
    """Index of the window from which a retry begins."""
    return max(0, min(window.index, effort.until - effort.retry))


def fell(problem: Problem, result: WindowResult) -> bool:
    """Whether a window failed, or left the corridor: `corridor_m` of the plan, 0 = none.

    What is compared is the mean distance of the body's points from the kinematic fit, at each frame.
    """
    corridor_m = problem.plan.recovery.corridor_m
    if result.status is WindowStatus.FAILED:
        return True
    if not corridor_m:
        return False
    stride, first = problem.clock.stride, result.window.start_step // problem.clock.stride
    qpos = qpos_of(problem.model, result.states[::stride])
    for frame, data in enumerate(posed(problem.model, qpos), start=first):
        off = data.site_xpos[problem.point_rows] - problem.points_m[frame]  # (M, 3)
        if float(np.linalg.norm(off, axis=-1).mean()) > corridor_m:
            return True
    return False
