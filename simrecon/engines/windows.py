"""All windows of a clip in a row, and once more from further back after a fall.

A window has fallen if its committed part leaves the plan's corridor around the kinematic fit, or if no
rollout stayed finite. The first retry goes back one window, the next one two, and so on, each with twice the
effort of the one before and other random numbers, up to the window that fell. If the plan's retries do not
help either, that window stays unsimulated, and the simulation begins anew at the kinematic fit of a later one
(`restarts`), with no more than one retry for the window that it begins with.

A window whose loss is in doubt (`doubts`) is solved once more together with the one before it, with other
random numbers, and the better pair stands.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from simrecon.engines import Tracker, doubts
from simrecon.engines.problem import Problem
from simrecon.observer import SILENT, Observer
from simrecon.sim.poses import posed
from simrecon.sim.state import qpos_of
from simrecon.system import blas
from simrecon.types import Effort, Handover, Window, WindowResult, WindowStatus

Restart = Callable[[Window], Handover | None]
"""Where a simulation may begin anew at a window; None: not there."""
RESTART_RETRIES = 1


@blas.one_thread()
def solve(
    tracker: Tracker,
    windows: Sequence[Window],
    start: Handover,
    seed: int,
    solved: Sequence[WindowResult] = (),
    observer: Observer = SILENT,
    keep: Callable[[WindowResult], None] | None = None,
    restart: Restart | None = None,
) -> tuple[WindowResult, ...]:
    """Solve the windows of a clip in order.

    A window depends on the seed, on what was handed over, and on its effort alone; so a run that goes on from
    `solved` ends with the bits of one that was never interrupted.

    Args:
        tracker: solves one window.
        windows: of the clip.
        start: where the first window begins.
        seed: of all random numbers.
        solved: windows that are known already: the first ones, perhaps with gaps that are known to be final.
        observer: hears how far the simulation is, and of each window that did not fall.
        keep: called with the same windows, before the observer; None: they are not kept.
        restart: where the simulation may begin anew after a fall; None: nowhere, the clip ends there.

    Returns:
        The windows that are simulated; those that are missing fell in spite of all retries.
    """
    course = _Course(windows, start, list(solved), restart)
    clock, retries = tracker.problem.clock, tracker.problem.plan.recovery.retries
    while (window := course.next()) is not None:
        observer.stage("simulation", window.start_step * clock.step_s, clock.duration_s)
        result = _solved(tracker, window, course.handover, course.effort, seed)
        if fell(tracker.problem, result):
            course.fell(window, retries)
            continue
        for stands in course.kept(_reconsidered(tracker, course, result, seed)):
            if keep is not None:
                keep(stands)
            observer.solved(stands, windows)
    observer.stage("simulation", clock.duration_s, clock.duration_s)
    return tuple(course.results)


def _solved(tracker: Tracker, window: Window, handover: Handover, effort: Effort, seed: int) -> WindowResult:
    rng = np.random.default_rng([seed, window.index, *effort.draw])
    return tracker.solve(window, handover, rng, effort)


def _reconsidered(
    tracker: Tracker, course: _Course, result: WindowResult, seed: int
) -> tuple[WindowResult, ...]:
    """A window that did not fall, or it and the one before it where both are better solved again."""
    before = course.before(result.window)
    if before is None or not doubts.doubtful(tracker.problem.plan.recovery, before, result):
        return (result,)
    tried: list[WindowResult] = []
    effort, handover = doubts.again(before, result), course.handover_of(before.window)
    for window in (before.window, result.window):
        tried.append(_solved(tracker, window, handover, effort, seed))
        if fell(tracker.problem, tried[-1]):
            return (result,)
        handover = tried[-1].handover
    return tuple(tried) if doubts.better(tried, [before, result]) else (result,)


class _Course:
    """Which window is solved next, from where, and with what effort.

    Attributes:
        results: windows that stand, in order.
        effort: of the next one.
    """

    def __init__(
        self, windows: Sequence[Window], start: Handover, solved: list[WindowResult], restart: Restart | None
    ) -> None:
        self.results, self._windows, self._restart = solved, windows, restart
        self.effort = solved[-1].effort if solved else Effort()
        self._end = len(windows)  # of the simulation that goes on: the window that fell for good, or the last
        self._begin, self._anew = 0, start
        if restarted := [result.window for result in solved if result.begins_anew]:
            self._begin_at(restarted[-1])

    def next(self) -> Window | None:
        """The next window; None at the end."""
        if self._index >= self._end and not self._begins_anew():
            return None
        window = self._windows[self._index]
        if self.effort.until < window.index:
            self.effort = Effort(0, window.index)
        return window

    @property
    def _index(self) -> int:
        after = self.results[-1].window.index + 1 if self.results else 0
        return max(after, self._begin)

    @property
    def handover(self) -> Handover:
        """What the next window begins with."""
        return self.handover_of(self._windows[self._index])

    def handover_of(self, window: Window) -> Handover:
        """What a window begins with, the next one or one that is solved."""
        if window.index == self._begin:
            return self._anew
        return next(one.handover for one in self.results if one.window.index == window.index - 1)

    def before(self, window: Window) -> WindowResult | None:
        """The window before the next one, in the same simulation; None where it begins."""
        return self.results[-1] if self.results and window.index > self._begin else None

    def is_restart(self, window: Window) -> bool:
        """Whether a simulation begins anew with a window."""
        return window.index == self._begin > 0

    def kept(self, solved: tuple[WindowResult, ...]) -> tuple[WindowResult, ...]:
        """Keep windows that did not fall, with the word on a gap before the first one.

        Args:
            solved: the next window, or it and those before it in the place of what there was.
        """
        first = solved[0].window
        del self.results[len(self.results) - (len(solved) - 1) :]
        if self.is_restart(first):
            gap_from = self.results[-1].window.index + 1 if self.results else 0
            solved = (replace(solved[0], gap_from=gap_from), *solved[1:])
        self.results.extend(solved)
        return solved

    def fell(self, window: Window, retries: int) -> None:
        """A window fell: go back, or leave it."""
        most = min(RESTART_RETRIES, retries) if self.is_restart(window) else retries
        if self.effort.retry < most:
            self.effort = Effort(self.effort.retry + 1, self.effort.until)
            self._go_back(window)
        elif window.index == self.effort.until:
            self._end = window.index
        else:  # what the retries lost is solved again as it was at first, up to where it fell
            self._end = self.effort.until
            self._go_back(window)
            self.effort = Effort()

    def _go_back(self, window: Window) -> None:
        """Forget the windows from the one on with which the retry begins."""
        first = max(self._begin, min(window.index, self.effort.until - self.effort.retry))
        self.results = [result for result in self.results if result.window.index < first]

    def _begins_anew(self) -> bool:
        """Begin after a window that fell for good, where the kinematic fit can be simulated."""
        for window in self._windows[self._end + 1 :]:
            if self._begin_at(window):
                self._end, self.effort = len(self._windows), Effort()
                return True
        return False

    def _begin_at(self, window: Window) -> bool:
        anew = None if self._restart is None else self._restart(window)
        if anew is not None:
            self._begin, self._anew = window.index, anew
        return anew is not None


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
