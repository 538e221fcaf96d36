"""Trackers: what makes the simulator follow a clip, window by window.

problem ─► make(name) ─► prepare ─► windows.solve: one solve() for each window ─► WindowResults

The engine `none` is no tracker: nothing is simulated, and the result holds the plan.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from simrecon.errors import InputError
from simrecon.types import Effort, Handover, Window, WindowResult

if TYPE_CHECKING:
    from simrecon.engines.problem import Problem
    from simrecon.sim.rollout import Threads

__all__ = ["ENGINES", "NOTHING", "Tracker", "check", "make", "names", "simulates"]

NOTHING = "none"
"""The engine that simulates nothing."""


class Tracker(Protocol):
    """Solves the windows of one clip.

    Attributes:
        problem: the clip, as the windows are solved now.
    """

    problem: Problem

    def prepare(self, windows: Sequence[Window], start: Handover) -> None:
        """Do what helps all windows, before the first of them is solved; `problem` may be another then.

        Args:
            windows: of the clip.
            start: where the first one begins.
        """

    def solve(
        self, window: Window, handover: Handover, rng: np.random.Generator, effort: Effort
    ) -> WindowResult:
        """Optimise a window from the state and knots that the last one handed over.

        Args:
            window: which part of the clip.
            handover: exact state at its start, and knots so far.
            rng: the only random numbers.
            effort: how much more than usual is spent, after a fall.
        """


def _sampling(problem: Problem, threads: Threads) -> Tracker:
    from simrecon.engines.sampling.sampler import Sampler

    return Sampler(problem, threads)


ENGINES: dict[str, Callable[[Problem, Threads], Tracker]] = {"sampling": _sampling}
"""Trackers by name; their code is imported when they are made."""


def names() -> tuple[str, ...]:
    """Names of the engines: the trackers, and `none`."""
    return (*ENGINES, NOTHING)


def simulates(name: str) -> bool:
    """Whether an engine simulates anything."""
    return name != NOTHING


def check(name: str) -> None:
    """Check that there is an engine.

    Raises:
        InputError: there is none of that name.
    """
    if name not in names():
        raise InputError(f"there is no engine {name!r}; valid: {', '.join(names())}")


def make(name: str, problem: Problem, threads: Threads = 0) -> Tracker:
    """The tracker of a name, for one clip.

    Args:
        name: of a tracker, a key of `ENGINES`.
        problem: the clip.
        threads: of the simulator, 0 for one per core; a function is called before each generation.

    Raises:
        InputError: no such name.
    """
    check(name)
    if not simulates(name):
        raise InputError(f"the engine {name!r} simulates nothing; valid: {', '.join(ENGINES)}")
    return ENGINES[name](problem, threads)
