"""Cholesky factor L of a banded Hessian, one block of frames after the other.

A row of the arrays is a column of L, from the diagonal down.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dpbtrf

from simrecon.kinematics.bands import REACH
from simrecon.kinematics.hessian import Curvature
from simrecon.kinematics.layout import FREE
from simrecon.types import Array, IntArray

DAMPING = 1e-6
"""Share of the diagonal that is added, so that the factor exists."""
WIDTH = FREE * (REACH + 1)
TAIL = FREE * REACH
"""Unknowns beyond a block of frames that it is tied to."""
STIFF = 1e100
"""What is added to the diagonal of frames to come, while those before them are factored."""
IDENTITY = np.eye(1, WIDTH)
"""A column of a factor that is the identity."""

_ROWS, _COLUMNS = np.indices((FREE, FREE))
_LOWER = _ROWS >= _COLUMNS


def _within(k: int) -> tuple[IntArray, IntArray, IntArray]:
    """Rows and columns of the block of frame t + k with t, and their places in (FREE · WIDTH) of the band."""
    there = _LOWER if k == 0 else np.ones_like(_LOWER)
    place = _COLUMNS * WIDTH + FREE * k + _ROWS - _COLUMNS
    return _ROWS[there], _COLUMNS[there], place[there]


_PLACES = tuple(_within(k) for k in range(REACH + 1))


def factored(part: Curvature, carried: Array) -> Array:
    """Columns (FREE (n + 2), WIDTH) of L of a block of n frames, and stiff ones after it.

    Args:
        part: the block.
        carried: (TAIL, TAIL) what the frames before take from its first unknowns.

    Raises:
        LinAlgError: the Hessian is not positive.
    """
    frames = len(part.border)
    band = np.zeros((frames + REACH, FREE, WIDTH))
    flat = band.reshape(frames + REACH, -1)
    for block, (row, column, place) in zip(part.blocks, _PLACES, strict=True):
        flat[: len(block), place] = block[:, row, column]
    band[:frames, :, 0] *= 1 + DAMPING
    band[frames:, :, 0] = STIFF
    for frame, k in ((0, 0), (0, 1), (1, 0)):
        row, column, place = _PLACES[k]
        flat[frame, place] -= carried[FREE * (frame + k) + row, FREE * frame + column]
    factor, failed = dpbtrf(band.reshape(-1, WIDTH).T, lower=1, overwrite_ab=1)
    if failed:
        raise np.linalg.LinAlgError(f"the curvature is not positive at unknown {failed} of a block")
    return np.asarray(factor.T)


def carried_by(band: Array) -> Array:
    """E Eᵀ (TAIL, TAIL) of the rows E of L that reach from a block's last frames to those after it."""
    reach = np.zeros((REACH, FREE, REACH, FREE))
    flat = band.reshape(-1, FREE * WIDTH)
    if len(flat) < 2 * REACH:  # the clip's last frame, alone
        return reach.reshape(TAIL, TAIL)
    last = flat[-2 * REACH : -REACH]
    for after, frame, k in ((0, 0, 2), (0, 1, 1), (1, 1, 2)):
        row, column, place = _PLACES[k]
        reach[after, row, frame, column] = last[frame, place]
    square = reach.reshape(TAIL, TAIL)
    return square @ square.T
