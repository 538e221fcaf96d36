"""Where the limbs start: turned to the bones of the 3D estimate."""

from __future__ import annotations

import numpy as np

from simrecon.geometry import rotations
from simrecon.kinematics import forward
from simrecon.kinematics.root import filled
from simrecon.types import Array, Skeleton

# Limb segment, the point that its bone leads to, the point beyond, and where the next bone turns when the
# joint between bends.
LIMBS = (
    ("shoulder", "elbow", "wrist", (1.0, 0.0, 0.0)),
    ("elbow", "wrist", None, None),
    ("hip", "knee", "ankle", (-1.0, 0.0, 0.0)),
    ("knee", "ankle", None, None),
    ("ankle", "toe", None, None),
)
PRIOR_WEIGHT = 0.05


def turned(skeleton: Skeleton, base: Array, joints_m: Array, weights: Array, neutral: Array) -> Array:
    """Rotation vectors (SEGMENTS, T, 3) that turn the limbs to the bone directions of the 3D estimate.

    Every limb segment is turned from its relaxed orientation, held weakly, to the direction of its bone and,
    as far as the next joint is bent, to the plane in which that joint bends. The trunk stays relaxed.

    Args:
        skeleton: gives bones and rest orientations.
        base: (T, 3, 3) orientation of the pelvis.
        joints_m: (M, T, 3) by point.
        weights: (M, T), zero where unknown.
        neutral: (JOINTS, 3) rotation vectors of the relaxed stance.
    """
    frames = len(base)
    rotvecs = np.zeros((len(skeleton.names), frames, 3))
    rotvecs[1:] = neutral[:, None]
    at = {name: row for row, name in enumerate(skeleton.point_names)}
    for segment, end, beyond, bend in LIMBS:
        for side in ("left", "right"):
            b = skeleton.names.index(f"{side}_{segment}")
            pose = forward.forward(skeleton, np.zeros((frames, 3)), base, rotvecs, 1.0)
            rows = [at[f"{side}_{name}"] for name in (segment, end, beyond) if name]
            known = np.all(weights[rows] > 0, axis=0)  # (T,)
            start_m, end_m = joints_m[rows[0]], joints_m[rows[1]]
            bone = _unit(end_m - start_m)  # (T, 3)
            source = [_unit(_bone(skeleton, f"{side}_{end}")), *np.eye(3)]
            target = [bone, *np.moveaxis(pose.axes[b], -1, 0)]
            weight = [np.ones(frames), *(np.full(frames, PRIOR_WEIGHT) for _ in range(3))]
            if beyond:
                following = _unit(joints_m[rows[2]] - end_m)
                across = following - np.sum(following * bone, axis=-1, keepdims=True) * bone
                source.append(np.array(bend))
                target.append(_unit(across))
                weight.append(np.sum(across**2, axis=-1))
            towards = rotations.align(
                np.broadcast_to(np.array(source), (frames, len(source), 3)),
                np.stack(target, axis=1),
                np.stack(weight, axis=1),
            )
            local = rotations.log(
                rotations.from_matrix(np.swapaxes(pose.before[b], -1, -2) @ towards)
            )  # (T, 3)
            low, high = skeleton.limits_rad[b - 1, :, 0], skeleton.limits_rad[b - 1, :, 1]
            if known.any():
                rotvecs[b] = filled(np.clip(local, low, high), known)
    return rotvecs


def _bone(skeleton: Skeleton, end: str) -> Array:
    """From the origin of the segment before to a point, in that segment's frame."""
    if end in skeleton.names:
        return np.asarray(skeleton.offsets_m[skeleton.names.index(end)])
    bone: Array = skeleton.point_offsets_m[skeleton.point_names.index(end)]
    return bone


def _unit(vectors: Array) -> Array:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    unit: Array = vectors / np.maximum(length, 1e-9)
    return unit
