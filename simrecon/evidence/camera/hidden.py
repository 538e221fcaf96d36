"""Evidence of a camera that nobody knows."""

from __future__ import annotations

import math
from dataclasses import replace

from simrecon.errors import InputError
from simrecon.evidence.camera import fov
from simrecon.types import Camera, Evidence

LYING_DEG, LYING_SIGMA = 54.4, 0.245
"""Across the longer side of an image that is wider than high: lenses from 35 to 80 degrees, which are two
deviations of the logarithm of the focal length to either side."""
STANDING_DEG, STANDING_SIGMA = 65.0, 0.15
"""The same of an image that is higher than wide: only phones are held so, whose main lens sees 60 to 70."""


def unknown_camera(evidence: Evidence) -> Evidence:
    """Evidence with a usual lens instead of its own, and without the camera's place.

    The principal point is the middle, there is no distortion. Focal length and place follow from the motion,
    in the kinematic fit.

    Raises:
        InputError: landmarks, but no image size.
    """
    if evidence.camera is None:
        if evidence.keypoint_names:
            raise InputError("unknown camera: found no image size; valid: --size WIDTHxHEIGHT, or --video")
        return evidence
    if evidence.camera.lens.focal_sigma and not evidence.ground_known:  # all of it was found in the images
        return evidence
    return replace(evidence, camera=usual(evidence.camera.lens.image_size_px))


def usual(size_px: tuple[int, int]) -> Camera:
    """A pinhole with the most probable focal length for an image of (width, height), and its deviation."""
    width, height = size_px
    angle, sigma = (STANDING_DEG, STANDING_SIGMA) if height > width else (LYING_DEG, LYING_SIGMA)
    return fov.pinhole(max(size_px) / 2 / math.tan(math.radians(angle) / 2), size_px, sigma)
