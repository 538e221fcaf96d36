"""Motions at other times and rates than their own; pure functions of arrays."""

from __future__ import annotations

import numpy as np

from simrecon.errors import InputError
from simrecon.io.messages import counted
from simrecon.types import Array

PAPER_HZ = 30.0
"""Rate of the papers whose scores count steps from frame to frame: Rempe 2020, WHAM, GVHMR."""
H36M_HZ = 25.0
"""Gärtner 2022, appendix D: "downsampled from 50 to 25 FPS"; Xie 2021, table 3, likewise."""

_TIME_TOLERANCE_S = 1e-6


def at(times_s: Array, own_times_s: Array, values: Array) -> Array:
    """Linear interpolation of (T, ...) to other times (N,) → (N, ...); held beyond the ends."""
    after = np.clip(np.searchsorted(own_times_s, times_s), 1, len(own_times_s) - 1)
    before = after - 1
    fraction = (times_s - own_times_s[before]) / (own_times_s[after] - own_times_s[before])  # (N,)
    weight = np.clip(fraction, 0.0, 1.0).reshape(-1, *(1,) * (values.ndim - 1))
    return np.asarray((1 - weight) * values[before] + weight * values[after])


def every(times_s: Array, rate_hz: float) -> Array:
    """Times over the same span at another rate, at least three."""
    count = max(3, int(np.floor((times_s[-1] - times_s[0]) * rate_hz + 1e-6)) + 1)
    return np.asarray(times_s[0] + np.arange(count, dtype=np.float64) / rate_hz)


def resampled(times_s: Array, values: Array, rate_hz: float) -> Array:
    """Values (T, ...) at another rate, by linear interpolation, (N, ...); times as `every` gives them."""
    return at(every(times_s, rate_hz), times_s, values)


def covered_times(motion_times_s: Array, truth_times_s: Array) -> Array:
    """The reference's times that the motion covers.

    Raises:
        InputError: fewer than three.
    """
    start, end = motion_times_s[0] - _TIME_TOLERANCE_S, motion_times_s[-1] + _TIME_TOLERANCE_S
    times = truth_times_s[(truth_times_s >= start) & (truth_times_s <= end)]
    if len(times) < 3:
        raise InputError(
            f"times_s: found {counted(len(times), 'frame')} of the reference from {start:.3f} to {end:.3f} "
            f"s, which the motion covers; valid: three or more"
        )
    return np.asarray(times)
