"""Pinhole projection with OpenCV's distortion model; camera frame x right, y down, z forward."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from simrecon.errors import InputError
from simrecon.geometry import rotations
from simrecon.types import Array, Camera, IntArray, Lens


def extrinsics(camera: Camera) -> Array:
    """The path of the camera: its transform world → camera in each frame, (T, 4, 4).

    Raises:
        InputError: the camera has none.
    """
    if camera.path is None:
        raise InputError("the camera has no world_to_camera transform")
    return camera.path


def still(lens: Lens, world_to_camera: Array, frames: int = 1) -> Camera:
    """A camera that stands at one transform (4, 4) for so many frames."""
    return Camera(lens, np.broadcast_to(world_to_camera, (frames, 4, 4)))


def with_path(camera: Camera, path: Array) -> Camera:
    """The same lens, carried along a path (T, 4, 4)."""
    return replace(camera, path=path)


def is_still(camera: Camera) -> bool:
    """Whether the camera has the same extrinsics in all frames; an unknown path counts as still."""
    return camera.path is None or bool((camera.path == camera.path[:1]).all())


def at(camera: Camera, frames: slice | IntArray | NDArray[np.bool_]) -> Camera:
    """The camera of some of its frames."""
    return camera if camera.path is None else replace(camera, path=camera.path[frames])


def lasting(camera: Camera, frames: int) -> Camera:
    """A camera that stands still where it is in its first frame, for so many frames."""
    return camera if camera.path is None else still(camera.lens, camera.path[0], frames)


def moved(camera: Camera, places_m: Array) -> Camera:
    """A camera with a path, each frame of which is moved by (T, 3)."""
    path = np.array(extrinsics(camera))
    path[:, :3, 3] -= (path[:, :3, :3] @ places_m[..., None])[..., 0]
    return with_path(camera, path)


def resampled(camera: Camera, times_s: Array, at_s: Array) -> Camera:
    """A camera of frames at increasing times (T,) at others (N,), its path held at the ends.

    Between two frames the centre goes along a line and the orientation turns about one axis (slerp); a camera
    that stands still stays exactly where it is.
    """
    if camera.path is None or is_still(camera):
        return lasting(camera, len(at_s))
    turns, centres = rotations.from_matrix(camera.path[:, :3, :3]), centre_m(camera)
    rotation = rotations.matrix(rotations.interpolate(times_s, turns, at_s))  # (N, 3, 3)
    centre = np.stack([np.interp(at_s, times_s, column) for column in centres.T], axis=-1)  # (N, 3)
    path = np.tile(np.eye(4), (len(at_s), 1, 1))
    path[:, :3, :3] = rotation
    path[:, :3, 3] = -(rotation @ centre[..., None])[..., 0]
    return with_path(camera, path)


def to_camera(camera: Camera, points_m: Array) -> Array:
    """World points (T, ..., 3) → camera frame, same shape; a camera of one frame takes any (..., 3)."""
    path = extrinsics(camera)
    transform = path.reshape(len(path), *(1,) * (points_m.ndim - 2), 4, 4)
    rotation, translation = transform[..., :3, :3], transform[..., :3, 3]
    return (rotation @ points_m[..., None])[..., 0] + translation


def to_world(camera: Camera, points_m: Array) -> Array:
    """Points (M, T, 3) in the camera's frame of each moment → world, same shape.

    A camera that stands still turns all of them at once.
    """
    path = extrinsics(camera)
    if is_still(camera):
        return np.asarray((points_m - path[0, :3, 3]) @ path[0, :3, :3])  # Rᵀ (x - t), row vectors
    off = np.swapaxes(points_m - path[:, :3, 3], 0, 1)  # (T, M, 3)
    return np.swapaxes(off @ path[:, :3, :3], 0, 1)


def project(camera: Camera, points_m: Array) -> Array:
    """World points (T, ..., 3) → pixels (T, ..., 2), with lens distortion; NaN behind the camera."""
    xyz = to_camera(camera, points_m)
    depth = np.where(xyz[..., 2] > 1e-6, xyz[..., 2], np.nan)
    return distort(camera.lens, xyz[..., :2] / depth[..., None])


def distort(lens: Lens, rays: Array) -> Array:
    """Ideal image-plane coordinates x/z, y/z (..., 2) → pixels (..., 2); Brown–Conrady k1 k2 p1 p2 k3."""
    k1, k2, p1, p2, k3 = lens.distortion
    x, y = rays[..., 0], rays[..., 1]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    k = lens.matrix_px
    return np.stack((k[0, 0] * xd + k[0, 1] * yd + k[0, 2], k[1, 1] * yd + k[1, 2]), axis=-1)


def undistort(lens: Lens, pixels: Array) -> Array:
    """Pixels (..., 2) → ideal image-plane coordinates x/z, y/z (..., 2); NaN stays NaN."""
    flat = np.ascontiguousarray(pixels, float).reshape(-1, 1, 2)
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-10)
    known = np.isfinite(flat).all(axis=(1, 2))
    rays = np.full((len(flat), 2), np.nan)
    if known.any():
        ideal = cv2.undistortPoints(flat[known], lens.matrix_px, lens.distortion, criteria=criteria)
        rays[known] = ideal[:, 0]
    return rays.reshape(np.shape(pixels))


def resected(lens: Lens, points_m: Array, pixels: Array) -> Array | None:
    """Where a camera stands (4, 4) that sees points (N, 3) of the world at pixels (N, 2), six or more.

    Perspective-n-point (SQPnP); None where the points do not say it, such as points at one place.
    """
    try:
        solved, rotvec, translation = cv2.solvePnP(
            points_m, pixels, lens.matrix_px, lens.distortion, flags=cv2.SOLVEPNP_SQPNP
        )
    except cv2.error:
        return None
    transform = np.eye(4)
    transform[:3, :3] = rotations.matrix(rotations.exp(np.ravel(rotvec)))
    transform[:3, 3] = np.ravel(translation)
    return transform if solved and np.isfinite(transform).all() else None


def focal_px(lens: Lens) -> float:
    """Geometric mean of the two focal lengths."""
    return float(np.sqrt(lens.matrix_px[0, 0] * lens.matrix_px[1, 1]))


def centre_m(camera: Camera) -> Array:
    """Optical centre in the world, (T, 3)."""
    path = extrinsics(camera)
    return -(np.swapaxes(path[..., :3, :3], -1, -2) @ path[..., :3, 3:])[..., 0]
