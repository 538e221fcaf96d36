"""Forces of the scene on each segment, step by step of the simulation, as force plates would give them.

A result holds means from frame to frame. Files for biomechanics want more: the moment about the centre of
pressure, and a rate of their own. Both are read from the simulation, which is stepped once more.
A plan has its forces at the frames, and no moment about the centre of pressure of a primitive.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from simrecon.errors import InputError
from simrecon.metrics.filters import low_pass
from simrecon.replay import NO_STEP, gaps_of
from simrecon.replay.trace import replay
from simrecon.results import Result
from simrecon.types import Array


@dataclass(frozen=True, eq=False)
class Loads:
    """What the scene does to S segments at H times.

    Attributes:
        force_N: (H, S, 3). centre_m: (H, S, 3) centre of pressure, NaN where nothing presses.
        moment_Nm: (H, S, 3) about the centre of pressure; on level ground only its vertical part, the free
            moment, is not zero.
    """

    force_N: Array
    centre_m: Array
    moment_Nm: Array


@dataclass(frozen=True, eq=False)
class Forces:
    """Sums over time, from which the mean over any span follows; N steps, S segments.

    Attributes:
        times_s: (N + 1,) ends of the steps, on the clock of the result.
        segments: S names.
        sums: (N + 1, S, 10) integrals over time of force, of its moment about the origin, of pressure, and of
            pressure times place.
    """

    times_s: Array
    segments: tuple[str, ...]
    sums: Array

    @property
    def rate_hz(self) -> float:
        """Steps a second."""
        return float((len(self.times_s) - 1) / (self.times_s[-1] - self.times_s[0]))

    def low_passed(self, cutoff_hz: float) -> Forces:
        """The same through a zero-lag Butterworth filter of fourth order (`metrics.filters.low_pass`)."""
        interval_s = 1.0 / self.rate_hz
        rows = np.diff(self.sums, axis=0).reshape(len(self.sums) - 1, -1)
        smooth = low_pass(rows, interval_s, cutoff_hz).reshape(-1, *self.sums.shape[1:])
        return replace(self, sums=np.concatenate((self.sums[:1], np.cumsum(smooth, axis=0))))

    def at(self, times_s: Array, span_s: float) -> Loads:
        """Means over a span around each time (H,), cut off where the simulation begins and ends.

        Impulse is kept: means over spans that join add up to the whole. Times beyond the ends show these.
        """
        times_s = np.clip(times_s, self.times_s[0], self.times_s[-1])
        low = np.clip(times_s - span_s / 2, self.times_s[0], self.times_s[-1])
        high = np.clip(times_s + span_s / 2, self.times_s[0], self.times_s[-1])
        flat = self.sums.reshape(len(self.sums), -1)
        ends = [
            np.stack([np.interp(when, self.times_s, column) for column in flat.T], axis=1)
            for when in (low, high)
        ]
        mean = (ends[1] - ends[0]) / np.maximum(high - low, 1e-12)[:, None]
        mean = mean.reshape(len(times_s), *self.sums.shape[1:])
        force, moment, pressure, placed = np.split(mean, (3, 6, 7), axis=-1)
        centre = np.full_like(force, np.nan)
        np.divide(placed, pressure, out=centre, where=pressure > 1e-6)
        about = moment - np.cross(np.nan_to_num(centre), force)
        return Loads(force, centre, np.where(np.isfinite(centre), about, 0.0))


def steps(result: Result) -> Forces:
    """The forces of a result's simulation, or of its plan where nothing was to be simulated.

    Raises:
        InputError: nothing was simulated, and no forces are planned.
    """
    motion = result.motion
    if motion.is_planned:
        return _planned(result)
    known = np.flatnonzero(motion.frame_step != NO_STEP)
    if not len(motion.ctrl) or not len(known):
        raise InputError(f"{result.folder}: found no simulated frame; valid: a result with forces")
    model = result.model
    trace = replay(model, motion.state0, motion.ctrl, motion.contact_body, gaps_of(motion))
    rows = np.concatenate(
        (trace.force_N, trace.couple_Nm, trace.pressure_N[..., None], trace.moment_Nm), axis=-1
    )  # (N + 1, C, 10)
    by_segment = _by_segment(result, rows)
    interval_s = float(model.opt.timestep)
    sums = np.concatenate((np.zeros_like(by_segment[:1]), np.cumsum(by_segment[1:] * interval_s, axis=0)))
    first = known[0]
    begin = float(motion.times_s[first] - motion.frame_step[first] * interval_s)
    ends = np.asarray(begin + interval_s * (np.arange(len(sums)) - 0.5))
    return Forces(ends, result.body.skeleton.names, sums)


def _planned(result: Result) -> Forces:
    """The forces of a plan, each from the middle between its frame and the one before to that after it."""
    motion = result.motion
    if not motion.knows_forces:
        raise InputError(f"{result.folder}: found a plan without forces; valid: a result with forces")
    force, centre = motion.contact_force_N, np.nan_to_num(motion.contact_point_m)
    pressure = np.linalg.norm(force, axis=-1, keepdims=True) * np.isfinite(motion.contact_point_m[..., :1])
    rows = np.concatenate(
        (force, np.cross(centre, force), pressure, pressure * centre), axis=-1
    )  # (T, C, 10)
    by_segment = _by_segment(result, rows)
    times = motion.times_s
    middles = (times[1:] + times[:-1]) / 2
    edges = np.concatenate(([2 * times[0] - middles[0]], middles, [2 * times[-1] - middles[-1]]))
    sums = np.cumsum(by_segment * np.diff(edges)[:, None, None], axis=0)
    sums = np.concatenate((np.zeros_like(by_segment[:1]), sums))
    return Forces(edges, result.body.skeleton.names, sums)


def _by_segment(result: Result, rows: Array) -> Array:
    """Sums over the primitives of each segment, (N, C, K) → (N, S, K)."""
    names = result.body.skeleton.names
    owner = {part.name: names.index(part.segment) for part in result.body.primitives}
    summed = np.zeros((len(rows), len(names), rows.shape[-1]))
    for column, part in enumerate(result.motion.contact_body):
        summed[:, owner[part]] += rows[:, column]
    return summed


def per_frame(forces: Forces, rate_hz: float) -> int:
    """How many samples of the forces a frame gets at a frame rate, so that they are about the steps."""
    return max(1, round(forces.rate_hz / rate_hz))
