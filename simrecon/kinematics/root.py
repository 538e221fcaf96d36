"""Where the root starts: its orientation from the trunk, its position from the image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from simrecon.body.skeleton import t_pose_m
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.types import Array, Camera, Skeleton

TRUNK = ("left_hip", "right_hip", "left_shoulder", "right_shoulder")


def filled(values: Array, known: NDArray[np.bool_]) -> Array:
    """Linear interpolation over frames, ends held; values (T, C), known (T,) bool.

    With no known frame at all the values are zero.
    """
    frames = np.arange(len(values))
    if not known.any():
        return np.zeros_like(values)
    columns = [np.interp(frames, frames[known], column[known]) for column in values.T]
    return np.stack(columns, axis=1)


def orientation(skeleton: Skeleton, joints_m: Array, weights: Array) -> Array:
    """Orientation of the pelvis (T, 3, 3) that best turns a T-pose's trunk into that of the 3D estimate.

    Args:
        skeleton: gives the T-pose.
        joints_m: (M, T, 3) by point of the skeleton.
        weights: (M, T), zero where unknown. Frames that lack a trunk take over their neighbours' orientation.
    """
    rows = [skeleton.point_names.index(name) for name in TRUNK]
    rest = t_pose_m(skeleton)[skeleton.point_segments[rows]] + skeleton.point_offsets_m[rows]  # (4, 3)
    seen = np.swapaxes(joints_m[rows], 0, 1)  # (T, 4, 3)
    known = np.all(weights[rows] > 0, axis=0)  # (T,)
    source = rest - rest.mean(axis=0)
    target = np.where(known[:, None, None], seen - seen.mean(axis=1, keepdims=True), source)
    quats = rotations.from_matrix(rotations.align(np.broadcast_to(source, target.shape), target))
    if not known.any():
        return rotations.matrix(quats)
    nearest = np.flatnonzero(known)
    times = np.arange(len(quats), dtype=float)
    if len(nearest) > 1:
        quats = rotations.interpolate(times[nearest], quats[nearest], times)
    else:
        quats = np.broadcast_to(quats[nearest[0]], quats.shape)
    return rotations.matrix(quats)


def position(rays: Array, weights: Array, joints_m: Array, camera: Camera, smooth_frames: float) -> Array:
    """Translation (T, 3) that puts the root-relative 3D estimate where the image has it.

    For each frame the linear equations u (z + t_z) = x + t_x, v (z + t_z) = y + t_y in the camera's frame are
    solved by weighted least squares; the depth is then smoothed over time, for it is the uncertain part.

    Args:
        rays: (M, T, 2) undistorted detections.
        weights: (M, T), zero where a detection or its 3D point is missing.
        joints_m: (M, T, 3) relative to the root, world axes.
        camera: with extrinsics.
        smooth_frames: standard deviation of the smoothing.
    """
    transform = cameras.extrinsics(camera)
    rotation, translation = transform[..., :3, :3], transform[..., :3, 3]
    xyz = (rotation @ joints_m[..., None])[..., 0]  # (M, T, 3) relative to the root, camera axes
    xyz = np.nan_to_num(xyz)
    rays = np.nan_to_num(rays)
    one, zero = np.ones(weights.shape), np.zeros(weights.shape)
    rows_u = np.stack((one, zero, -rays[..., 0]), axis=-1)  # (M, T, 3)
    rows_v = np.stack((zero, one, -rays[..., 1]), axis=-1)
    right_u = rays[..., 0] * xyz[..., 2] - xyz[..., 0]
    right_v = rays[..., 1] * xyz[..., 2] - xyz[..., 1]
    normal = np.einsum("mt,mti,mtj->tij", weights, rows_u, rows_u) + np.einsum(
        "mt,mti,mtj->tij", weights, rows_v, rows_v
    )
    right = np.einsum("mt,mti,mt->ti", weights, rows_u, right_u) + np.einsum(
        "mt,mti,mt->ti", weights, rows_v, right_v
    )
    known = (weights > 0).sum(axis=0) >= 4
    solved = np.linalg.solve(normal + 1e-9 * np.eye(3), right[..., None])[..., 0]  # (T, 3)
    known &= solved[:, 2] > 0.3
    depth = filled(solved[:, 2:], known)
    ratio = filled(solved[:, :2] / np.where(known, solved[:, 2], 1.0)[:, None], known)
    depth = gaussian_filter1d(depth, smooth_frames, axis=0, mode="nearest")
    place = np.concatenate((ratio * depth, depth), axis=1)
    return (np.swapaxes(rotation, -1, -2) @ (place - translation)[..., None])[..., 0]
