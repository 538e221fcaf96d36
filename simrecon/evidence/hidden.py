"""Evidence of a camera that nobody knows."""

from __future__ import annotations

import math
from dataclasses import replace

from simrecon.errors import InputError
from simrecon.evidence import fov
from simrecon.types import Camera, Evidence


def unknown_camera(evidence: Evidence) -> Evidence:
    """Evidence with a usual lens instead of its own, and without the camera's place.

    The focal length is the image's diagonal (a field of view of 53 degrees across it), the prior of 4DHumans
    (Goel et al., ICCV 2023) and WHAM (Shin et al., CVPR 2024); the principal point is the middle, there is no
    distortion. The place follows from the ground plane, in the kinematic fit.

    Raises:
        InputError: landmarks, but no image size.
    """
    if evidence.camera is None:
        if evidence.keypoint_names:
            raise InputError("unknown camera: found no image size; valid: --size WIDTHxHEIGHT, or --video")
        return evidence
    return replace(evidence, camera=usual(evidence.camera.lens.image_size_px))


def usual(size_px: tuple[int, int]) -> Camera:
    """A pinhole whose focal length is the diagonal of an image of (width, height)."""
    return fov.pinhole(math.hypot(*size_px), size_px)
