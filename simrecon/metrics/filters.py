"""The low-pass filter of force comparisons; pure functions of arrays."""

from __future__ import annotations

import numpy as np
import scipy

from simrecon.errors import InputError
from simrecon.geometry import rotations
from simrecon.types import Array

NYQUIST_SHARE = 0.8
"""Of half the sampling rate, up to which a cut-off is used: nearer to it a filter lets all pass."""


def possible_hz(cutoff_hz: float, interval_s: float) -> float:
    """A cut-off, or the highest one that the sampling rate allows if that is lower."""
    return min(cutoff_hz, NYQUIST_SHARE * 0.5 / interval_s)


def low_pass(values: Array, interval_s: float, cutoff_hz: float, order: int = 4) -> Array:
    """Zero-lag Butterworth low-pass along the first axis, (T, ...) → (T, ...).

    Run forwards and backwards (Winter 2009, section 2.2.4.4), so a filter of order 4 is two passes of order
    2, each with its cut-off raised by the factor of that section, so that both together have the one that
    is given.

    Args:
        values: finite.
        interval_s: between rows.
        cutoff_hz: where amplitude falls to 0.707; below half the sampling rate.
        order: even, of both passes together.

    Raises:
        InputError: a cut-off that the sampling rate doesn't allow, or too few rows.
    """
    passes = order // 2
    # One pass of order n has |H|² = 1 / (1 + w^2n); two in a row are at 1/√2 where w^2n = √2 − 1.
    raised = np.tan(np.pi * cutoff_hz * interval_s) / (np.sqrt(2.0) - 1.0) ** (0.5 / passes)
    corner = 2.0 * np.arctan(raised) / np.pi if 0 < cutoff_hz * interval_s < 0.5 else 1.0
    if not 0 < corner < 1:
        raise InputError(f"cut-off: found {cutoff_hz:g} Hz; valid: above 0, below {0.5 / interval_s:g} Hz")
    sections = scipy.signal.butter(passes, corner, output="sos")
    pad = min(len(values) - 1, round(1.0 / (cutoff_hz * interval_s)))
    return np.asarray(scipy.signal.sosfiltfilt(sections, values, axis=0, padlen=pad))


def low_passed_poses(qpos: Array, interval_s: float, cutoff_hz: float) -> Array:
    """Places of the root and quaternions (T, nq) of a person through `low_pass`, the quaternions unit again.

    Raises:
        InputError: the frame rate does not allow the cut-off.
    """
    turns = qpos[:, 3:].reshape(len(qpos), -1, 4)
    flips = np.where((turns[1:] * turns[:-1]).sum(axis=-1) < 0, -1.0, 1.0).cumprod(axis=0)
    steady = turns * np.concatenate((np.ones_like(flips[:1]), flips))[..., None]
    columns = np.concatenate((qpos[:, :3], steady.reshape(len(qpos), -1)), axis=1)
    slow = low_pass(columns, interval_s, cutoff_hz)
    unit = rotations.canonical(slow[:, 3:].reshape(turns.shape))
    return np.concatenate((slow[:, :3], unit.reshape(len(qpos), -1)), axis=1)
