"""What the contact network looks at: landmarks by name around each frame, the same at any frame rate.

For each of O times around a frame and each of N points: place in the image and score, place in 3D and whether
it is known. Places count from the hips of the frame itself, so that they hold velocities (Rempe 2020, section
3.2). A point that is missing is zero.
"""

from __future__ import annotations

import numpy as np

from simrecon.types import Array, IntArray

SIDED = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle", "heel", "toe")
POINTS = ("nose", *(f"{side}_{name}" for name in SIDED for side in ("left", "right")))
"""N points of the body."""
OFFSETS_S = np.linspace(-0.25, 0.25, 11)
"""The O times, s."""
CHANNELS = 7
COUNT = len(OFFSETS_S) * len(POINTS) * CHANNELS
MIN_SCORE = 0.1
_HIPS = [POINTS.index(f"{side}_hip") for side in ("left", "right")]


def features(
    image: Array,
    scores: Array,
    joints_m: Array,
    known: Array,
    interval_s: float,
    rows: IntArray | None = None,
) -> Array:
    """Inputs of the network, (R, COUNT), of some frames.

    Args:
        image: (T, N, 2) places in the image of a camera that stands still, any unit; NaN = not seen.
        scores: (T, N) in [0, 1].
        joints_m: (T, N, 3) in a world with z up; NaN = unknown.
        known: (T, N) 0 or 1.
        interval_s: between frames.
        rows: (R,) frames; None: all.
    """
    frames = np.arange(len(image)) if rows is None else rows
    scores = np.where(np.isfinite(image).all(axis=-1) & (scores >= MIN_SCORE), scores, 0.0)
    known = np.where(np.isfinite(joints_m).all(axis=-1), known, 0.0)
    flat, size = np.nan_to_num(image), _size(image, scores)
    seen = _around(flat, scores, frames, interval_s) - _hips(flat, scores)[frames, None, None]
    sure = _around(scores[..., None], scores, frames, interval_s)
    solid, there = np.nan_to_num(joints_m), _around(known[..., None], known, frames, interval_s)
    placed = _around(solid, known, frames, interval_s) - _hips(solid, known)[frames, None, None]
    placed = np.einsum("rij,ronj->roni", _heading(solid)[frames], placed)
    parts = (seen / size * (sure > 0), sure, placed * (there > 0), there > 0)
    return np.concatenate(parts, axis=-1).reshape(len(frames), COUNT).astype(np.float32)


def _size(image: Array, scores: Array) -> float:
    """Of the person in the image: about half the height of one who stands."""
    known = scores[..., None] > 0
    count = np.maximum(known.sum(axis=1), 1)  # (T, 1)
    middle = np.where(known, np.nan_to_num(image), 0.0).sum(axis=1) / count  # (T, 2)
    apart = np.where(known, np.nan_to_num(image) - middle[:, None], 0.0)
    spread = np.sqrt((apart**2).sum(axis=(1, 2)) / count[:, 0])
    return 1.5 * float(np.quantile(spread, 0.9)) or 1.0


def _around(values: Array, weights: Array, frames: IntArray, interval_s: float) -> Array:
    """Values (T, N, C) at the times around frames, (R, O, N, C), between the frames beside that are known."""
    at = np.clip(frames[:, None] + OFFSETS_S / interval_s, 0, len(values) - 1)  # (R, O)
    low = np.minimum(np.floor(at).astype(np.int64), max(len(values) - 2, 0))
    high = np.minimum(low + 1, len(values) - 1)
    part = (at - low)[..., None]
    left, right = (1 - part) * (weights[low] > 0), part * (weights[high] > 0)  # (R, O, N)
    total = np.maximum(left + right, 1e-9)[..., None]
    return np.asarray((left[..., None] * values[low] + right[..., None] * values[high]) / total)


def _hips(values: Array, weights: Array) -> Array:
    """Middle of the hips that are known, else of all that is, (T, C)."""
    hips = np.maximum(weights[:, _HIPS], 0.0)
    own = np.where(hips.sum(axis=1, keepdims=True) > 0, np.zeros_like(weights), weights)
    own[:, _HIPS] = hips
    total = np.maximum(own.sum(axis=1), 1e-9)[:, None]
    return np.asarray((own[..., None] * values).sum(axis=1) / total)


def _heading(joints_m: Array) -> Array:
    """Rotations (T, 3, 3) about z to axes along which the hips face: ahead, to the left, up."""
    across = joints_m[:, _HIPS[0]] - joints_m[:, _HIPS[1]]
    angle = np.arctan2(-across[:, 0], across[:, 1])
    cos, sin, zero, one = np.cos(angle), np.sin(angle), np.zeros(len(angle)), np.ones(len(angle))
    rows = [[cos, sin, zero], [-sin, cos, zero], [zero, zero, one]]
    return np.moveaxis(np.array(rows), -1, 0)
