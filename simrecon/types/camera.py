"""The camera that saw a clip."""

from __future__ import annotations

from dataclasses import dataclass

from simrecon.types.arrays import Array


@dataclass(frozen=True, eq=False)
class Camera:
    """A calibrated camera.

    Attributes:
        matrix_px: (3, 3) intrinsic matrix K.
        distortion: (5,) OpenCV coefficients k1 k2 p1 p2 k3.
        world_to_camera: (4, 4) or (T, 4, 4) rigid transform, or None where the extrinsics are unknown.
        image_size_px: (width, height).
    """

    matrix_px: Array
    distortion: Array
    world_to_camera: Array | None
    image_size_px: tuple[int, int]
