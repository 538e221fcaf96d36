"""Cameras in OpenCV's FileStorage: YAML, XML or JSON, with the keys that its samples and ROS write."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from simrecon.errors import InputError
from simrecon.evidence.camera import calibration
from simrecon.evidence.camera.calibration import Calibration
from simrecon.io import foreign
from simrecon.io.foreign.storage import KEYS


def matches(raw: bytes) -> bool:
    """Whether these are the bytes of such a file."""
    head = raw.lstrip()[:400]
    return (
        head.startswith((b"%YAML", b"<?xml", b"<opencv_storage"))
        or b"!!opencv-matrix" in raw
        or (b"camera_matrix:" in raw)
    )


def read(path: Path, raw: bytes) -> list[Calibration]:
    """The one camera of a file with the bytes `raw`.

    Raises:
        InputError: a damaged file, or one without a camera matrix.
    """
    try:
        keys = foreign.parse("storage", raw)
    except foreign.DamageError as error:
        raise InputError(f"{path}: found a damaged OpenCV file ({error}); valid: a whole one") from error
    if "matrix" not in keys:
        raise InputError(f"{path}: camera matrix: found none; valid: a key of {', '.join(KEYS['matrix'])}")
    matrix = keys["matrix"].reshape(3, 3) if keys["matrix"].size == 9 else keys["matrix"]
    distortion = calibration.distortion(path, "distortion_coefficients", keys.get("distortion", np.zeros(5)))
    size = keys.get("size")
    if "width" in keys and "height" in keys:
        size = np.concatenate((keys["width"].ravel(), keys["height"].ravel()))
    pose = None
    if "rotation" in keys and "translation" in keys:
        pose = calibration.rigid(path, "rvec", keys["rotation"], keys["translation"])
    shape = calibration.size(path, "image_size", size)
    return [
        Calibration(path.stem, calibration.matrix(path, "camera_matrix", matrix), distortion, shape, pose)
    ]
