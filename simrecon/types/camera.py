"""The camera that saw a clip: a lens, and the path along which it was carried."""

from __future__ import annotations

from dataclasses import dataclass

from simrecon.types.arrays import Array


@dataclass(frozen=True, eq=False)
class Lens:
    """Intrinsics: a pinhole with OpenCV's distortion.

    Attributes:
        matrix_px: (3, 3) intrinsic matrix K.
        distortion: (5,) OpenCV coefficients k1 k2 p1 p2 k3.
        image_size_px: (width, height).
        focal_sigma: deviation of the natural logarithm of the focal length where nobody knows it; 0: known.
    """

    matrix_px: Array
    distortion: Array
    image_size_px: tuple[int, int]
    focal_sigma: float = 0.0


@dataclass(frozen=True, eq=False)
class Camera:
    """A calibrated camera.

    Attributes:
        lens: its intrinsics.
        path: (T, 4, 4) extrinsics, the rigid transform world → camera of each frame of the evidence; a camera
            that stands still repeats its own. None where the extrinsics are unknown.
    """

    lens: Lens
    path: Array | None = None
