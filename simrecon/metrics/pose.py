"""How far joints are from a reference's, as pure functions of arrays (docs/metrics.md).

Axes: T frames, J joints; leading axes are batches. Metres and seconds unless a name says otherwise. Means
skip joints that are NaN in either motion; without any known joint a score is NaN.
"""

from __future__ import annotations

import numpy as np

from simrecon.types import Array

CHUNK_FRAMES = 100
"""Frames of a piece of W- and WA-MPJPE: SLAHMR (Ye 2023), WHAM (Shin 2024), GVHMR (Shen 2024), at 30 fps."""
FIRST_FRAMES = 2
"""Frames that the alignment of W-MPJPE looks at (the same sources)."""
PCK_M = 0.15
"""Mehta et al. 2017, "Monocular 3D Human Pose Estimation In The Wild": half the size of a head."""


def mean_known(values: Array, axes: tuple[int, ...]) -> Array:
    """Mean over axes of what is not NaN; NaN where nothing is known."""
    known = np.isfinite(values)
    count = known.sum(axes)
    total = np.where(known, values, 0.0).sum(axes)
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan))


def distances(joints: Array, truth: Array) -> Array:
    """Distance of each joint, (..., T, J, 3) → (..., T, J)."""
    return np.asarray(np.linalg.norm(joints - truth, axis=-1))


def mpjpe_g(joints: Array, truth: Array) -> Array:
    """MPJPE-G: mean distance of joints in the world, (..., T, J, 3) → (...).

    Gärtner 2022 section 4 and Rempe 2020 table 3 ("Body"), who align nothing here.
    """
    return mean_known(distances(joints, truth), (-2, -1))


def mpjpe_g_align1(joints: Array, truth: Array, root: Array, truth_root: Array) -> Array:
    """`mpjpe_g` after one translation that puts the roots (..., T, 3) of the first frame together.

    Rempe 2020 table 3 ("Body-Align 1"); Gärtner 2022 reports this as MPJPE-G ("first frame translation
    aligned", appendix C).
    """
    return mpjpe_g(joints - root[..., :1, None, :], truth - truth_root[..., :1, None, :])


def mpjpe(joints: Array, truth: Array, root: Array, truth_root: Array) -> Array:
    """MPJPE: mean distance of joints relative to the root of their frame; roots (..., T, 3) → (...).

    Ionescu et al. 2014 (Human3.6M), protocol 1.
    """
    return mpjpe_g(joints - root[..., None, :], truth - truth_root[..., None, :])


def mpjpe_pa(joints: Array, truth: Array) -> Array:
    """MPJPE-PA: `mpjpe_g` after the similarity transform of each frame that fits best (`procrustes`)."""
    return mpjpe_g(procrustes(joints, truth), truth)


def procrustes(points: Array, target: Array, *, with_scale: bool = True) -> Array:
    """Points (..., J, 3) under the rotation, scale and translation nearest to the target in least squares.

    Umeyama 1991, eqs. 39-42: reflections are excluded.

    Args:
        points: (..., J, 3), finite.
        target: (..., J, 3), finite.
        with_scale: False keeps the size.
    """
    rotation, scale, shift = similarity(points, target, with_scale=with_scale)
    return np.asarray(scale[..., None, None] * points @ np.swapaxes(rotation, -1, -2) + shift[..., None, :])


def similarity(points: Array, target: Array, *, with_scale: bool = True) -> tuple[Array, Array, Array]:
    """The transform of `procrustes`: rotation (..., 3, 3), scale (...), translation (..., 3)."""
    centre, target_centre = points.mean(-2, keepdims=True), target.mean(-2, keepdims=True)
    a, b = points - centre, target - target_centre  # (..., J, 3)
    u, values, vt = np.linalg.svd(np.swapaxes(b, -1, -2) @ a)  # (..., 3, 3), (..., 3), (..., 3, 3)
    sign = np.ones_like(values)
    sign[..., 2] = np.sign(np.linalg.det(u @ vt))
    rotation = (u * sign[..., None, :]) @ vt  # (..., 3, 3)
    spread = np.square(a).sum((-2, -1))
    scale = (values * sign).sum(-1) / np.where(spread > 0, spread, 1.0)  # (...)
    if not with_scale:
        scale = np.ones_like(scale)
    moved = scale[..., None, None] * centre @ np.swapaxes(rotation, -1, -2)  # (..., 1, 3)
    return rotation, np.asarray(scale), np.asarray(target_centre - moved)[..., 0, :]


def chunked(
    joints: Array, truth: Array, *, first: bool, with_scale: bool = True, frames: int = CHUNK_FRAMES
) -> Array:
    """Joints after one alignment of each piece of a clip, (T, J, 3) → (T, J, 3).

    The clip is cut into pieces of 100 frames, the last one shorter; each is moved by one similarity transform
    (`procrustes`) that fits its first two frames (W-MPJPE), or all of them (WA-MPJPE).

    Args:
        joints: (T, J, 3), finite.
        truth: (T, J, 3), finite.
        first: fit the first two frames of a piece only.
        with_scale: as in the published evaluations; False shows errors of scale.
        frames: of a piece. The published numbers are of 30 frames a second.
    """
    moved = np.empty_like(joints)
    for start in range(0, len(joints), frames):
        piece = slice(start, start + frames)
        a, b = joints[piece], truth[piece]
        count = FIRST_FRAMES if first else len(a)
        rotation, scale, shift = similarity(
            a[:count].reshape(-1, 3), b[:count].reshape(-1, 3), with_scale=with_scale
        )
        moved[piece] = scale * a @ rotation.T + shift
    return moved


def first_frame_aligned(joints: Array, truth: Array) -> Array:
    """Joints after the one rotation and translation that fits the first frame, (T, J, 3) → (T, J, 3).

    For a camera that nobody knows: heading, lean and place of the world are then anybody's guess.
    NaN if a joint of the first frame is unknown.
    """
    if not (np.isfinite(joints[0]).all() and np.isfinite(truth[0]).all()):
        return np.full_like(joints, np.nan)
    rotation, _, shift = similarity(joints[0], truth[0], with_scale=False)
    return np.asarray(joints @ rotation.T + shift)


def w_mpjpe(joints: Array, truth: Array, *, with_scale: bool = True, frames: int = CHUNK_FRAMES) -> float:
    """W-MPJPE: `mpjpe_g` after `chunked` on the first two frames (SLAHMR, WHAM, GVHMR)."""
    return float(mpjpe_g(chunked(joints, truth, first=True, with_scale=with_scale, frames=frames), truth))


def wa_mpjpe(joints: Array, truth: Array, *, with_scale: bool = True, frames: int = CHUNK_FRAMES) -> float:
    """WA-MPJPE: `mpjpe_g` after `chunked` on whole pieces (SLAHMR, WHAM, GVHMR)."""
    return float(mpjpe_g(chunked(joints, truth, first=False, with_scale=with_scale, frames=frames), truth))


def root_error(root: Array, truth_root: Array) -> Array:
    """Mean distance of the roots, (..., T, 3) → (...); Xie 2021 table 3 ("global root position")."""
    return mean_known(np.linalg.norm(root - truth_root, axis=-1), (-1,))


def root_translation_error_pct(root: Array, truth_root: Array) -> Array:
    """RTE: mean distance of the roots after one rigid alignment, in percent of the way, (T, 3) → ().

    WHAM (Shin 2024): the alignment has no scale, the way is the length of the reference's path.
    """
    way = np.linalg.norm(np.diff(truth_root, axis=-2), axis=-1).sum(-1)
    error = root_error(procrustes(root, truth_root, with_scale=False), truth_root)
    return np.asarray(np.where(way > 0, 100.0 * error / np.where(way > 0, way, 1.0), np.nan))


def mpjpe_2d(points_px: Array, truth_px: Array) -> Array:
    """MPJPE-2d: mean distance over the landmarks known in both, px, (..., T, J, 2) → (...); NaN without any.

    Gärtner 2022 section 4, "image alignment".
    """
    return mean_known(distances(points_px, truth_px), (-2, -1))


def pck_pct(joints: Array, truth: Array, threshold: float = PCK_M) -> Array:
    """PCK: share of joints nearer than a threshold, percent of those known in both, (..., T, J, D) → (...).

    Mehta et al. 2017 with 150 mm on root-aligned 3D joints; with pixels and a threshold in pixels, PCK of the
    image.
    """
    distance = distances(joints, truth)
    near = np.where(np.isfinite(distance), distance < threshold, np.nan)
    return np.asarray(100.0 * mean_known(near, (-2, -1)))
