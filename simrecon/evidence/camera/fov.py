"""What a video and a field of view say of the camera."""

from __future__ import annotations

import math

import numpy as np

from simrecon.errors import InputError
from simrecon.types import Camera, Lens

RATE_RANGE_HZ = (2.0, 2000.0)
FOV_RANGE_DEG = (1.0, 170.0)


def from_fov(fov_deg: float | None, size_px: tuple[int, int] | None) -> Camera | None:
    """A camera without distortion from its horizontal field of view and (width, height); None without one.

    Raises:
        InputError: a field of view, but no size.
    """
    if fov_deg is None:
        return None
    if size_px is None:
        raise InputError("--fov: found no image size; valid: --size WIDTHxHEIGHT beside it, or --video")
    focal = size_px[0] / 2 / math.tan(math.radians(fov_deg) / 2)
    return pinhole(focal, size_px)


def pinhole(focal_px: float, size_px: tuple[int, int], focal_sigma: float = 0.0) -> Camera:
    """A camera without distortion that looks through the middle of its image; (0, 0) is the first pixel's."""
    x, y = (size_px[0] - 1) / 2, (size_px[1] - 1) / 2
    matrix = np.array([[focal_px, 0.0, x], [0.0, focal_px, y], [0.0, 0.0, 1.0]])
    return Camera(Lens(matrix, np.zeros(5), size_px, focal_sigma))
