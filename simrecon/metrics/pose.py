"""How far joints are from a reference's, by frame, as pure functions of arrays (docs/metrics.md).

Every function ending in `_errors` gives the error of each joint; the score of that name is their mean
(`statistics.of_frames`). Axes: T frames, J joints; leading axes are batches. Metres unless a name says
otherwise. What is NaN in either motion stays NaN.
"""

from __future__ import annotations

import numpy as np

from simrecon.metrics.alignment import chunked, first_frame_aligned, procrustes
from simrecon.types import Array

PCK_M = 0.15
"""Mehta et al. 2017, "Monocular 3D Human Pose Estimation In The Wild": half the size of a head."""


def mean_known(values: Array, axes: tuple[int, ...]) -> Array:
    """Mean over axes of what is not NaN; NaN where nothing is known."""
    known = np.isfinite(values)
    count = known.sum(axes)
    total = np.where(known, values, 0.0).sum(axes)
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan))


def distances(points: Array, truth: Array) -> Array:
    """Distance of each point, (..., J, D) → (..., J); nothing is aligned.

    Of joints in the world, its mean is MPJPE-G (Gärtner 2022 section 4; Rempe 2020 table 3, "Body"); of
    roots, the root error (Xie 2021 table 3, "global root position"); of landmarks in pixels, MPJPE-2d
    (Gärtner 2022 section 4, "image alignment").
    """
    return np.asarray(np.linalg.norm(points - truth, axis=-1))


def mpjpe_errors(joints: Array, truth: Array, root: Array, truth_root: Array) -> Array:
    """MPJPE: distance of each joint relative to the root of its frame, (..., T, J, 3) → (..., T, J).

    Ionescu et al. 2014 (Human3.6M), protocol 1; roots (..., T, 3).
    """
    return distances(joints - root[..., None, :], truth - truth_root[..., None, :])


def mpjpe_pa_errors(joints: Array, truth: Array) -> Array:
    """MPJPE-PA: the same after the similarity transform of each frame that fits best (`procrustes`).

    (..., T, J, 3) → (..., T, J); frames in which a joint is unknown are NaN.
    """
    known = np.isfinite(joints).all((-2, -1)) & np.isfinite(truth).all((-2, -1))  # (..., T)
    moved = np.full_like(joints, np.nan)
    moved[known] = procrustes(joints[known], truth[known])
    return distances(moved, truth)


def mpjpe_g_align1_errors(joints: Array, truth: Array, root: Array, truth_root: Array) -> Array:
    """MPJPE-G after one translation that joins the roots of the first frame, (..., T, J, 3) → (..., T, J).

    Rempe 2020 table 3 ("Body-Align 1"); Gärtner 2022 reports this as MPJPE-G ("first frame translation
    aligned", appendix C); roots (..., T, 3).
    """
    return distances(joints - root[..., :1, None, :], truth - truth_root[..., :1, None, :])


def mpjpe_g_rigid1_errors(joints: Array, truth: Array) -> Array:
    """MPJPE-G after the rotation and translation that fits the first frame, (T, J, 3) → (T, J).

    See `alignment.first_frame_aligned`.
    """
    return distances(first_frame_aligned(joints, truth), truth)


def w_mpjpe_errors(joints: Array, truth: Array, *, first: bool, with_scale: bool = True) -> Array:
    """W-MPJPE (`first`) and WA-MPJPE: distances after one alignment of each piece, (T, J, 3) → (T, J).

    SLAHMR, WHAM and GVHMR; see `alignment.chunked` for pieces and arguments.
    """
    return distances(chunked(joints, truth, first=first, with_scale=with_scale), truth)


def pck_hits(joints: Array, truth: Array, root: Array, truth_root: Array, threshold: float = PCK_M) -> Array:
    """PCK: which joints are nearer than 150 mm relative to their root, 1 or 0, (..., T, J, 3) → (..., T, J).

    Mehta et al. 2017. NaN where a joint is unknown in either motion.
    """
    distance = mpjpe_errors(joints, truth, root, truth_root)
    return np.where(np.isfinite(distance), distance < threshold, np.nan)


def root_translation_error_pct(root: Array, truth_root: Array) -> Array:
    """RTE: mean distance of the roots after one rigid alignment, in percent of the way, (T, 3) → ().

    WHAM (Shin 2024): the alignment has no scale, the way is the length of the reference's path.
    """
    way = np.linalg.norm(np.diff(truth_root, axis=-2), axis=-1).sum(-1)
    error = mean_known(distances(procrustes(root, truth_root, with_scale=False), truth_root), (-1,))
    return np.asarray(np.where(way > 0, 100.0 * error / np.where(way > 0, way, 1.0), np.nan))
