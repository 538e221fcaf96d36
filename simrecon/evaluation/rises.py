"""When a person sits, stands and rises, from the height of the hips or from what bears the person."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter1d

from simrecon.contact import rules
from simrecon.types import Array, Flags

# Who sits down comes up by this much; within that of the highest hips is up.
SITS_LEAST_M, NEAR_M = 0.15, 0.05
# A load rises above the first share of weight, and has let go below the second, as a mean over this time.
BORNE_PCT, FREE_PCT, SMOOTH_S = 40.0, 5.0, 0.2


def rests(hips_m: Array, interval_s: float) -> tuple[Flags, Flags]:
    """Frames in which a person sits still and in which one stands, from the middle of the hips (T, 3)."""
    height = hips_m[:, 2]
    low, high = np.percentile(height, [5.0, 95.0])
    speed = np.linalg.norm(np.gradient(hips_m, interval_s, axis=0), axis=-1)
    sitting = rules.sits(height, low, speed)
    return sitting, np.asarray(height > high - NEAR_M)


def rises(height_m: Array) -> int:
    """How often hips go from the lower to the upper quarter of their range, (T,)."""
    low, high = np.percentile(height_m, [5.0, 95.0])
    quarter = (high - low) / 4
    return _climbs(height_m < low + quarter, height_m > high - quarter)


def releases(load_pct: Array, interval_s: float) -> int:
    """How often a load (T,) of `BORNE_PCT` is followed by none, as a mean over `SMOOTH_S`."""
    smooth = uniform_filter1d(load_pct, max(1, round(SMOOTH_S / interval_s)), mode="nearest")
    return _climbs(smooth > BORNE_PCT, smooth < FREE_PCT)


def _climbs(before: Flags, after: Flags) -> int:
    """How often frames that are `after` follow ones that are `before`."""
    marks = np.where(before, 1, 0) + np.where(after, 2, 0)
    seen = marks[marks > 0]
    return int(((seen[:-1] == 1) & (seen[1:] == 2)).sum())
