"""Pinhole projection with OpenCV's distortion model; camera frame x right, y down, z forward."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from simrecon.errors import InputError
from simrecon.types import Array, Camera


def extrinsics(camera: Camera) -> Array:
    """The world-to-camera transform, (4, 4) or (T, 4, 4).

    Raises:
        InputError: the camera has none.
    """
    if camera.world_to_camera is None:
        raise InputError("the camera has no world_to_camera transform")
    return camera.world_to_camera


def to_camera(camera: Camera, points_m: Array) -> Array:
    """World points (T, ..., 3) or (..., 3) → camera frame, same shape."""
    transform = extrinsics(camera)
    if transform.ndim == 3:
        transform = transform.reshape(len(transform), *(1,) * (points_m.ndim - 2), 4, 4)
    rotation, translation = transform[..., :3, :3], transform[..., :3, 3]
    return (rotation @ points_m[..., None])[..., 0] + translation


def project(camera: Camera, points_m: Array) -> Array:
    """World points (..., 3) → pixels (..., 2), with lens distortion; NaN behind the camera."""
    xyz = to_camera(camera, points_m)
    depth = np.where(xyz[..., 2] > 1e-6, xyz[..., 2], np.nan)
    return distort(camera, xyz[..., :2] / depth[..., None])


def distort(camera: Camera, rays: Array) -> Array:
    """Ideal image-plane coordinates x/z, y/z (..., 2) → pixels (..., 2); Brown–Conrady k1 k2 p1 p2 k3."""
    k1, k2, p1, p2, k3 = camera.distortion
    x, y = rays[..., 0], rays[..., 1]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    k = camera.matrix_px
    return np.stack((k[0, 0] * xd + k[0, 1] * yd + k[0, 2], k[1, 1] * yd + k[1, 2]), axis=-1)


def undistort(camera: Camera, pixels: Array) -> Array:
    """Pixels (..., 2) → ideal image-plane coordinates x/z, y/z (..., 2); NaN stays NaN."""
    flat = np.ascontiguousarray(pixels, float).reshape(-1, 1, 2)
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-10)
    known = np.isfinite(flat).all(axis=(1, 2))
    rays = np.full((len(flat), 2), np.nan)
    if known.any():
        ideal = cv2.undistortPoints(flat[known], camera.matrix_px, camera.distortion, criteria=criteria)
        rays[known] = ideal[:, 0]
    return rays.reshape(np.shape(pixels))


def focal_px(camera: Camera) -> float:
    """Geometric mean of the two focal lengths."""
    return float(np.sqrt(camera.matrix_px[0, 0] * camera.matrix_px[1, 1]))


def centre_m(camera: Camera) -> Array:
    """Optical centre in the world, (3,) or (T, 3)."""
    transform = extrinsics(camera)
    return -(np.swapaxes(transform[..., :3, :3], -1, -2) @ transform[..., :3, 3:])[..., 0]


def with_extrinsics(camera: Camera, world_to_camera: Array) -> Camera:
    """The same lens elsewhere."""
    return replace(camera, world_to_camera=world_to_camera)
