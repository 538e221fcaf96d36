"""Forward kinematics of all frames, and its adjoint: from gradients of points to gradients of the pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon.geometry import rotations
from simrecon.types import Array, IntArray, Skeleton


@dataclass(frozen=True, eq=False)
class Pose:
    """Segments of all frames in the world.

    Attributes:
        origins_m: (SEGMENTS, T, 3) joint centres.
        axes: (SEGMENTS, T, 3, 3) rotation matrices R_b, segment → world.
        before: (SEGMENTS, T, 3, 3) R_parent · rest_b: the frame in which the joint's rotation vector counts.
        jacobians: (SEGMENTS, T, 3, 3) left Jacobian of each rotation vector.
    """

    origins_m: Array
    axes: Array
    before: Array
    jacobians: Array


def forward(skeleton: Skeleton, root_m: Array, root_base: Array, rotvecs: Array, scale: float) -> Pose:
    """Positions and orientations of the segments.

    Args:
        skeleton: unscaled.
        root_m: (T, 3).
        root_base: (T, 3, 3) orientation from which the root's rotation vector is counted.
        rotvecs: (SEGMENTS, T, 3) rotation vectors, root first.
        scale: factor on all lengths.
    """
    count, frames = rotvecs.shape[:2]
    local = rotations.matrix(rotations.exp(rotvecs))  # (SEGMENTS, T, 3, 3)
    rest = rotations.matrix(skeleton.rest)  # (SEGMENTS, 3, 3)
    origins, axes, before = np.empty((count, frames, 3)), np.empty_like(local), np.empty_like(local)
    origins[0], before[0] = root_m, root_base
    axes[0] = root_base @ local[0]
    for b in range(1, count):
        parent = skeleton.parents[b]
        origins[b] = origins[parent] + axes[parent] @ (scale * skeleton.offsets_m[b])
        before[b] = axes[parent] @ rest[b]
        axes[b] = before[b] @ local[b]
    return Pose(origins, axes, before, rotations.left_jacobian(rotvecs))


def at(pose: Pose, frames: IntArray) -> Pose:
    """The pose of some frames."""
    every = (pose.origins_m, pose.axes, pose.before, pose.jacobians)
    return Pose(*(values[:, frames] for values in every))


def points(pose: Pose, segments: IntArray, offsets_m: Array) -> Array:
    """World positions (M, T, 3) of points fixed to segments at offsets_m (M, 3)."""
    axes = pose.axes[segments].reshape(len(segments), -1, 3)  # (M, 3 T, 3): one product for all frames
    return pose.origins_m[segments] + (axes @ offsets_m[..., None]).reshape(len(segments), -1, 3)


def adjoint(
    skeleton: Skeleton, pose: Pose, segments: IntArray, points_m: Array, gradient: Array
) -> tuple[Array, Array]:
    """Gradient with respect to the pose of a loss with known gradient with respect to points.

    The forces on a subtree add up; their moment about the joint, pulled back through the rotation vector, is
    the gradient: dE/dv = J_l(v)ᵀ (R_parent rest)ᵀ Σ (p - o) × dE/dp.

    Args:
        skeleton: gives the tree.
        pose: from `forward`.
        segments: (M,) segment of each point.
        points_m: (M, T, 3) from `points`.
        gradient: (M, T, 3) dE/dp.

    Returns:
        Force on each segment and all below it, which is dE/d root_m of the first, and dE/d rotvecs; both
        (SEGMENTS, T, 3).
    """
    count, frames = pose.origins_m.shape[:2]
    owner = (segments == np.arange(count)[:, None]).astype(np.float64)  # (SEGMENTS, M)
    force = (owner @ gradient.reshape(len(segments), -1)).reshape(count, frames, 3)
    about = cross(points_m, gradient)  # about the world's origin
    moment = (owner @ about.reshape(len(segments), -1)).reshape(count, frames, 3)
    for b in range(count - 1, 0, -1):
        force[skeleton.parents[b]] += force[b]
        moment[skeleton.parents[b]] += moment[b]
    about_joint = moment - cross(pose.origins_m, force)  # (SEGMENTS, T, 3)
    local = np.swapaxes(pose.before @ pose.jacobians, -1, -2) @ about_joint[..., None]
    return force, local[..., 0]


def turned(rotvecs: Array, points_m: Array) -> Array:
    """Points (M, T, 3) turned about the origin by the rotation vector (T, 3) of their frame."""
    return rotated(rotations.matrix(rotations.exp(rotvecs)), points_m)


def rotated(matrices: Array, points_m: Array) -> Array:
    """Points (M, T, 3) on the axes of the matrix (T, 3, 3) of their frame, or of one (3, 3) for all."""
    by_frame = np.swapaxes(points_m, 0, 1) @ np.swapaxes(matrices, -1, -2)  # one product for all points
    return np.swapaxes(by_frame, 0, 1)


def cross(a: Array, b: Array) -> Array:
    """Cross product over the last axis; several times as fast as numpy's."""
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        product[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return product
