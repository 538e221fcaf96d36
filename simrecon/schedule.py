"""Time: simulation steps and frames, overlapping windows, and how solved windows are stitched."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from simrecon.plan import Plan
from simrecon.types import Array, Window, WindowResult


@dataclass(frozen=True)
class Clock:
    """Frames fall on simulation steps.

    Attributes:
        frame_s: frame interval.
        stride: simulation steps per frame.
        frames: number of frames.
    """

    frame_s: float
    stride: int
    frames: int

    @property
    def step_s(self) -> float:
        """Simulation time step."""
        return self.frame_s / self.stride

    @property
    def steps(self) -> int:
        """Simulation steps from the first frame to the last."""
        return (self.frames - 1) * self.stride

    @property
    def duration_s(self) -> float:
        """From the first frame to the last."""
        return self.steps * self.step_s


def clock(times_s: Array, timestep_max_s: float) -> Clock:
    """The largest time step up to `timestep_max_s` that is an integer fraction of the frame interval."""
    frame_s = float(times_s[1] - times_s[0])
    return Clock(frame_s, max(1, math.ceil(frame_s / timestep_max_s - 1e-9)), len(times_s))


def cut(clock: Clock, plan: Plan) -> tuple[Window, ...]:
    """Windows over the whole clip; every window starts and commits on frames.

    The last window commits all that is left; a rest no longer than the overlap is part of it.
    """
    length = max(1, round(plan.window.length_s / clock.frame_s))
    commit = max(1, min(length, round(plan.window.commit_s / clock.frame_s)))
    last = clock.frames - 1
    windows: list[Window] = []
    start = 0
    while start < last:
        end = min(start + length, last)
        kept = end if end == last else min(start + commit, last)
        windows.append(Window(len(windows), *(frame * clock.stride for frame in (start, kept, end))))
        start = kept
    return tuple(windows)


def stitch(results: tuple[WindowResult, ...]) -> Array:
    """The control (N, nu) of all windows on the steps of the clip, zero in gaps."""
    last = results[-1]
    control = np.zeros((last.window.start_step + len(last.ctrl), last.ctrl.shape[1]))
    for result in results:
        start = result.window.start_step
        control[start : start + len(result.ctrl)] = result.ctrl
    return control
