"""Scores of sampled futures against the one that happened (Yuan & Kitani 2020; Xie 2021, section 4.3).

All are of root-aligned joints (…, J, 3), m: places less that of the root, which is the first joint.
"""

from __future__ import annotations

import numpy as np

from simrecon.types import Array


def aligned(joints_m: Array) -> Array:
    """Places (..., J - 1, 3) of the other joints relative to the first (..., J, 3)."""
    return np.asarray(joints_m[..., 1:, :] - joints_m[..., :1, :])


def ade(samples_m: Array, true_m: Array) -> float:
    """Average distance error of the best sample, m: mean over frames and joints.

    Args:
        samples_m: (S, F, J, 3).
        true_m: (F, J, 3).
    """
    return float(_distances(samples_m, true_m).mean(axis=(1, 2)).min())


def fde(samples_m: Array, true_m: Array) -> float:
    """Final distance error of the sample that ends best, m: mean over joints in the last frame."""
    return float(_distances(samples_m, true_m)[:, -1].mean(axis=1).min())


def apd(samples_m: Array) -> float:
    """Average pairwise distance, m: mean L2 distance of two samples (S, F, J, 3) as vectors of all frames.

    It grows with the square root of the number of frames.
    """
    flat = aligned(samples_m).reshape(len(samples_m), -1)
    one, other = np.triu_indices(len(flat), 1)
    return float(np.linalg.norm(flat[one] - flat[other], axis=1).mean())


def _distances(samples_m: Array, true_m: Array) -> Array:
    """(S, F, J - 1) m."""
    return np.asarray(np.linalg.norm(aligned(samples_m) - aligned(true_m), axis=-1))
