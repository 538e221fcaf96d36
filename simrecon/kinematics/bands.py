"""How frames are tied: bands over time of Rᵀ diag(w) R, with rows of R that reach over up to three frames.

Band k holds the coefficients (T - k,) of frame t + k with frame t.
"""

from __future__ import annotations

import numpy as np

from simrecon.types import Array

REACH = 2
"""Frames on either side that a frame is tied to."""

Bands = list[Array]


def none(frames: int) -> Bands:
    """Bands that tie nothing."""
    return [np.zeros(frames - k) for k in range(REACH + 1)]


def squared(weights: Array, row: tuple[float, ...] | Array, frames: int) -> Bands:
    """Bands of Rᵀ diag(w) R, where row i of R holds `row` (or its own (len(w), 3)) from column i on."""
    taps = np.broadcast_to(np.asarray(row), (len(weights), np.shape(row)[-1]))
    bands = none(frames)
    for i in range(taps.shape[1]):
        for j in range(i + 1):
            start = slice(j, j + len(weights))
            bands[i - j][start] += weights * taps[:, i] * taps[:, j]
    return bands


def first_differences(weights: Array) -> Bands:
    """Bands of D₁ᵀ diag(w) D₁ with a weight for each step from a frame to the next, (T - 1,)."""
    return squared(weights, (-1.0, 1.0), len(weights) + 1)


def second_differences(frames: int, weight: float) -> Bands:
    """Bands of weight · D₂ᵀ D₂."""
    return squared(np.full(max(frames - 2, 0), weight), (1.0, -2.0, 1.0), frames)
