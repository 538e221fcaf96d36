"""Left and right that a network mixed up in some frames, found by how the limbs would have to jump.

For the arms and the legs each, the frames are given the states kept and swapped so that the sum of all
jumps from frame to frame, and of a small cost per swapped frame, is least (Viterbi). What a crossing of
limbs leaves open stays as it was.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simrecon.evidence.video.blazepose import NAMES
from simrecon.types import Array

ARMS = ("shoulder", "elbow", "wrist", "pinky", "index", "thumb")
LEGS = ("hip", "knee", "ankle", "heel", "foot_index")
GAP_MAX_S = 0.3
SCORE_MIN = 0.3
JUMP_MAX = 0.5  # of one landmark, m
SWAPPED_COST = 0.02  # per frame, in units of mean jumps
_CHUNK = 4096  # frames at a time, for long videos


def pairs(parts: tuple[str, ...]) -> NDArray[np.int64]:
    """Indices (P, 2) of left and right landmarks."""
    return np.array([[NAMES.index(f"{side}_{part}") for side in ("left", "right")] for part in parts])


def find(
    times_s: Array, points_px: Array, scores: Array, world_m: Array, scale_px: Array
) -> NDArray[np.bool_]:
    """Frames in which left and right are mixed up.

    Args:
        times_s: (T,) increasing.
        points_px: (T, 33, 2), NaN where unseen.
        scores: (T, 33).
        world_m: (T, 33, 3), NaN where unseen or hidden.
        scale_px: (T,) pixels per metre, about.

    Returns:
        (T, 2) for arms and legs.
    """
    seen = np.flatnonzero(np.isfinite(points_px).all(axis=(1, 2)) & np.isfinite(world_m).all(axis=(1, 2)))
    result = np.zeros((len(times_s), 2), bool)
    if len(seen) < 3:
        return result
    linked = np.diff(times_s[seen]) <= GAP_MAX_S  # (S - 1,)
    for k, parts in enumerate((ARMS, LEGS)):
        keep, cross = np.empty(len(seen) - 1), np.empty(len(seen) - 1)
        for start in range(0, len(keep), _CHUNK):
            rows = seen[start : start + _CHUNK + 1]
            places = np.concatenate((points_px[rows] / scale_px[rows, None, None], world_m[rows]), axis=-1)
            part = slice(start, start + len(rows) - 1)
            keep[part], cross[part] = _jumps(places, scores[rows], pairs(parts))
        result[seen, k] = _viterbi(np.where(linked, keep, 0.0), np.where(linked, cross, 0.0), linked)
    return result


def _jumps(places: Array, scores: Array, index: NDArray[np.int64]) -> tuple[Array, Array]:
    """Mean jump (S - 1,) of landmarks (S, 33, 5) to the next frame: as they are, with sides exchanged."""
    sides = places[:, index]  # (S, P, 2, 5)
    weight = np.where(scores[:, index] >= SCORE_MIN, scores[:, index], 0.0).min(axis=-1)  # (S, P)
    weight = np.minimum(weight[1:], weight[:-1])
    total = np.maximum(weight.sum(axis=1), 1e-9)

    def jump(after: Array) -> Array:
        size = np.linalg.norm(after - sides[:-1], axis=-1)  # (S - 1, P, 2)
        return np.asarray((np.minimum(size, JUMP_MAX).sum(axis=-1) * weight).sum(axis=1) / total)

    return jump(sides[1:]), jump(sides[1:, :, ::-1])


def _viterbi(keep: Array, cross: Array, linked: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The states (S,) of least cost, True = swapped; across a gap the states are independent."""
    count = len(keep) + 1
    best = np.array([0.0, SWAPPED_COST])
    back = np.zeros((count, 2), np.int64)
    for t in range(1, count):
        stay, change = (keep[t - 1], cross[t - 1]) if linked[t - 1] else (0.0, 0.0)
        via = best[:, None] + np.array([[stay, change], [change, stay]])  # (before, after)
        back[t] = via.argmin(axis=0)
        best = via.min(axis=0) + np.array([0.0, SWAPPED_COST])
    states = np.zeros(count, np.int64)
    states[-1] = int(best.argmin())
    for t in range(count - 1, 0, -1):
        states[t - 1] = back[t, states[t]]
    return states.astype(bool)


def exchange(values: Array, swapped: NDArray[np.bool_]) -> Array:
    """Landmarks (T, 33, ...) with left and right exchanged where (T, 2) arms and legs are mixed up."""
    result = values.copy()
    for k, parts in enumerate((ARMS, LEGS)):
        rows = np.flatnonzero(swapped[:, k])
        index = pairs(parts)
        result[np.ix_(rows, index.ravel())] = values[np.ix_(rows, index[:, ::-1].ravel())]
    return result
