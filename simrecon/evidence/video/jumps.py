"""Landmarks that jump away for one frame and back in the next, which no limb does."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simrecon.types import Array

AWAY_M = 0.35
"""Least way there and back; the fastest hands go as far in a thirtieth of a second, but do not return."""
BACK_SHARE = 0.5
"""Of the way, how near it comes to where it was."""
GAP_MAX_S = 0.12


def find(times_s: Array, points_px: Array, scale_px: Array) -> NDArray[np.bool_]:
    """Landmarks (T, 33) that jump.

    Args:
        times_s: (T,) increasing.
        points_px: (T, 33, 2), NaN where unseen.
        scale_px: (T,) pixels per metre, about.
    """
    result = np.zeros(points_px.shape[:2], bool)
    if len(times_s) < 3:
        return result
    places = points_px / scale_px[:, None, None]
    step = np.linalg.norm(np.diff(places, axis=0), axis=-1)  # (T - 1, 33)
    there, again = step[:-1], step[1:]
    least = np.minimum(there, again)
    back = np.linalg.norm(places[2:] - places[:-2], axis=-1)
    near = (times_s[2:] - times_s[:-2] <= 2 * GAP_MAX_S)[:, None]
    with np.errstate(invalid="ignore"):
        result[1:-1] = near & (least > AWAY_M) & (back < BACK_SHARE * least)
    return result
