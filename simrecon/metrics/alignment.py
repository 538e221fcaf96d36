"""Alignments that come before an error, as pure functions of arrays (docs/metrics.md).

Axes: T frames, J joints; leading axes are batches.
"""

from __future__ import annotations

import numpy as np

from simrecon.types import Array

CHUNK_FRAMES = 100
"""Frames of a piece of W- and WA-MPJPE: SLAHMR (Ye 2023), WHAM (Shin 2024), GVHMR (Shen 2024), at 30 fps."""
FIRST_FRAMES = 2
"""Frames that the alignment of W-MPJPE looks at (the same sources)."""


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
