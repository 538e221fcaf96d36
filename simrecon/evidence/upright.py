"""Evidence of a turned image, or of one whose pixels are not square, as that of the upright image."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon.types import Array, Camera, Evidence, Lens

_QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""Turns x right, y down by 90° clockwise: what was at the right comes down."""


def upright(seen: Evidence, turn_deg: int, aspect: float = 1.0) -> Evidence:
    """The evidence of an image that is stretched to square pixels and then turned.

    Motion in the world is left as it is; the camera turns about its line of sight.

    Args:
        seen: of the image as it is stored; with a camera if it has landmarks in it.
        turn_deg: clockwise, a multiple of 90.
        aspect: width of a pixel over its height.
    """
    if seen.camera is not None:
        camera = stretched(seen.camera, aspect)
        points = seen.keypoints_px * [aspect, 1.0] + [0.5 * (aspect - 1), 0.0]
        seen = replace(seen, camera=camera, keypoints_px=points)
    for _ in range(turn_deg // 90 % 4):
        seen = _quarter(seen)
    return seen


def stored(camera: Camera, turn_deg: int, aspect: float = 1.0) -> Camera:
    """The camera of the stored image, from that of the upright one: the inverse of `upright`."""
    for _ in range(-turn_deg // 90 % 4):
        camera = quarter(camera)
    return stretched(camera, 1 / aspect)


def stretched(camera: Camera, factor: float) -> Camera:
    """The camera of an image that is made wider; (0, 0) is the centre of the first pixel."""
    if factor == 1.0:
        return camera
    lens = camera.lens
    matrix, (width, height) = lens.matrix_px.copy(), lens.image_size_px
    matrix[0, 0] *= factor
    matrix[0, 2] = factor * (matrix[0, 2] + 0.5) - 0.5
    return replace(camera, lens=Lens(matrix, lens.distortion, (round(width * factor), height)))


def quarter(camera: Camera) -> Camera:
    """The camera of an image that is turned by 90° clockwise."""
    lens = camera.lens
    (k1, k2, p1, p2, k3), (width, height) = lens.distortion, lens.image_size_px
    fx, fy, cx, cy = lens.matrix_px[[0, 1, 0, 1], [0, 1, 2, 2]]
    matrix = np.array([[fy, 0.0, height - 1 - cy], [0.0, fx, cx], [0.0, 0.0, 1.0]])
    turned = Lens(matrix, np.array([k1, k2, p2, -p1, k3]), (height, width))
    if camera.path is None:
        return Camera(turned)
    turn = np.eye(4)
    turn[:3, :3] = _QUARTER
    return Camera(turned, turn @ camera.path)


def _quarter(seen: Evidence) -> Evidence:
    joints: Array = seen.joints_m
    if seen.joints_frame != "world":
        joints = joints @ _QUARTER.T
    if seen.camera is None:
        return replace(seen, joints_m=joints)
    height = seen.camera.lens.image_size_px[1]
    x, y = seen.keypoints_px[..., 0], seen.keypoints_px[..., 1]
    points = np.stack((height - 1 - y, x), axis=-1)
    return replace(seen, joints_m=joints, keypoints_px=points, camera=quarter(seen.camera))
