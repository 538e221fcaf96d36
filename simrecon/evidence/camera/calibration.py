"""One camera of a calibration file, and the checks of its numbers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from simrecon.errors import InputError
from simrecon.evidence import ranges
from simrecon.types import Array


@dataclass(frozen=True)
class Calibration:
    """One camera of a file; None = the file doesn't have it.

    Attributes:
        name: by which it is chosen.
        matrix_px: (3, 3) K.
        distortion: (5,) k1 k2 p1 p2 k3.
        size_px: width and height of its images.
        world_to_camera: (4, 4).
        z_up: whether its world is known to be z up.
    """

    name: str
    matrix_px: Array
    distortion: Array
    size_px: tuple[int, int] | None
    world_to_camera: Array | None
    z_up: bool = False


def rigid(path: Path, key: str, rotation: Array, translation: Array) -> Array:
    """The transform (4, 4) of a rotation vector (3,) or matrix (3, 3) and a translation (3,), checked."""
    if rotation.size not in (3, 9) or translation.size != 3:
        found = f"{rotation.size} and {translation.size} numbers"
        raise InputError(f"{path}: {key}: found {found}; valid: a rotation of 3 or 9, a translation of 3")
    if not (np.isfinite(rotation).all() and np.isfinite(translation).all()):
        raise InputError(f"{path}: {key}: found numbers that are not finite; valid: finite ones")
    if np.abs(translation).max() > ranges.POSITION_MAX_M:
        found = f"a translation of {np.abs(translation).max():g}"
        raise InputError(f"{path}: {key}: {found}; valid: at most {ranges.POSITION_MAX_M:g} m")
    if np.abs(rotation).max() > ranges.TURN_MAX:
        found = f"a rotation of {np.abs(rotation).max():g}"
        raise InputError(f"{path}: {key}: found {found}; valid: at most {ranges.TURN_MAX:g} rad")
    pose = np.eye(4)
    pose[:3, :3] = cv2.Rodrigues(rotation.reshape(3, 1))[0] if rotation.size == 3 else rotation.reshape(3, 3)
    pose[:3, 3] = translation.reshape(3)
    error = np.abs(pose[:3, :3].T @ pose[:3, :3] - np.eye(3)).max()
    if error > 1e-4 or np.linalg.det(pose[:3, :3]) < 0:
        raise InputError(
            f"{path}: {key}: found a matrix that is no rotation; valid: a rotation (3,) or (3, 3)"
        )
    return pose


def size(path: Path, key: str, values: Array | None) -> tuple[int, int] | None:
    """Width and height of the images, checked; None of None."""
    if values is None:
        return None
    low, high = ranges.SIDE_PX
    flat = np.asarray(values, float).ravel()
    if flat.size != 2 or not ((flat >= low) & (flat <= high)).all():
        found = flat.tolist() if flat.size < 10 else f"{flat.size} numbers"
        raise InputError(f"{path}: {key}: found {found}; valid: width and height from {low} to {high} px")
    return int(flat[0]), int(flat[1])


def matrix(path: Path, key: str, values: Array) -> Array:
    """K (3, 3), checked: a pinhole without skew."""
    if (
        values.shape != (3, 3)
        or not np.isfinite(values).all()
        or values[0, 0] <= 0
        or values[1, 1] <= 0
        or abs(values[2, 2] - 1) > 1e-6
    ):
        shown = values.tolist() if values.size < 10 else f"shape {values.shape}"
        raise InputError(
            f"{path}: {key}: found {shown}; valid: [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] in pixels"
        )
    values = values.copy()
    values[0, 1] = 0.0 if abs(values[0, 1]) < 1e-6 * values[0, 0] else values[0, 1]
    if values[0, 1] != 0:
        raise InputError(f"{path}: {key}: found a skew of {values[0, 1]:g}; valid: 0")
    return values


def distortion(path: Path, key: str, values: Array) -> Array:
    """The first five of OpenCV's coefficients, checked: 4 or 5 of them, or none."""
    flat = values.ravel()
    if not (np.abs(flat) <= ranges.DISTORTION_MAX).all():
        raise InputError(f"{path}: {key}: found {flat.tolist()}; valid: at most {ranges.DISTORTION_MAX:g}")
    if flat.size > 5 and np.any(flat[5:]):
        raise InputError(
            f"{path}: {key}: found {flat.size} coefficients; valid: k1 k2 p1 p2 k3, further ones 0"
        )
    if flat.size < 4 and flat.size != 0:
        raise InputError(f"{path}: {key}: found {flat.size} coefficients; valid: 4 or 5, k1 k2 p1 p2 k3")
    return np.concatenate((flat[:5], np.zeros(max(5 - flat.size, 0))))
