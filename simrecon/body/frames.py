"""Frames of the segments of a person who stands in any relaxed pose, from joint centres and a few points.

The segments' axes are those of the world in a T-pose that faces +x (`models/body/skeleton.toml`): a bone of
the arm lies along y, a bone of the leg along z, the sole is level and the foot points forward.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from simrecon.types import Array

FORWARD, UP = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
SIDES = (("left", 1.0), ("right", -1.0))


def segment_frames(names: tuple[str, ...], at_m: Mapping[str, Array]) -> Array:
    """Orientation of each segment.

    The trunk and the head are taken for upright. Upper arm and forearm share the axis about which the elbow
    bends; the hand is flat through the knuckles, or, without knuckles, turned like the forearm.

    Args:
        names: of the segments, `pelvis` first.
        at_m: joint centres (..., 3) by name of the segment, and `left_heel`, `left_toe` and, if known,
            `left_index` and `left_pinky`, and the same on the right; person faces +x, z is up.

    Returns:
        (..., S, 3, 3) columns are the segment's axes in the world.
    """
    shape = np.shape(at_m["left_hip"])[:-1]
    axes = {name: np.broadcast_to(np.eye(3), (*shape, 3, 3)) for name in names}
    for side, sign in SIDES:
        shoulder, elbow, wrist = (
            np.asarray(at_m[f"{side}_{joint}"]) for joint in ("shoulder", "elbow", "wrist")
        )
        hip, knee, ankle = (np.asarray(at_m[f"{side}_{joint}"]) for joint in ("hip", "knee", "ankle"))
        upper = _along_y(sign * (elbow - shoulder), FORWARD)
        hinge = np.cross(sign * (wrist - elbow), upper[..., 2])  # (..., 3) forward
        axes[f"{side}_shoulder"] = upper
        axes[f"{side}_elbow"] = _along_y(sign * (wrist - elbow), hinge)
        axes[f"{side}_wrist"] = _hand(side, sign, wrist, at_m, axes[f"{side}_elbow"])
        axes[f"{side}_hip"] = _along_z(hip - knee, FORWARD)
        axes[f"{side}_knee"] = _along_z(knee - ankle, FORWARD)
        foot = np.asarray(at_m[f"{side}_toe"]) - np.asarray(at_m[f"{side}_heel"])
        axes[f"{side}_ankle"] = _along_z(np.broadcast_to(UP, foot.shape), foot)
    return np.stack([axes[name] for name in names], axis=-3)


def _hand(side: str, sign: float, wrist: Array, at_m: Mapping[str, Array], forearm: Array) -> Array:
    if f"{side}_index" not in at_m or f"{side}_pinky" not in at_m:
        return forearm
    index, pinky = np.asarray(at_m[f"{side}_index"]), np.asarray(at_m[f"{side}_pinky"])
    return _along_y(sign * (0.5 * (index + pinky) - wrist), index - pinky)


def _along_y(bone: Array, forward: Array) -> Array:
    """Frame (..., 3, 3) with y along a bone, and x as near to `forward` as that allows."""
    y = _unit(bone)
    x = _unit(forward - np.sum(forward * y, axis=-1, keepdims=True) * y)
    return np.stack((x, y, np.cross(x, y)), axis=-1)


def _along_z(bone: Array, forward: Array) -> Array:
    """Frame (..., 3, 3) with z along a bone, and x as near to `forward` as that allows."""
    z = _unit(bone)
    x = _unit(forward - np.sum(forward * z, axis=-1, keepdims=True) * z)
    return np.stack((x, np.cross(z, x), z), axis=-1)


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))
