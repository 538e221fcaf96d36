"""Cameras in OpenCV's FileStorage: YAML, XML or JSON, with the keys that its samples and ROS write."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np

from simrecon.errors import InputError
from simrecon.evidence.camera import calibration
from simrecon.evidence.camera.calibration import Calibration
from simrecon.types import Array

KEYS = {
    "matrix": ("camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "intrinsics", "M1"),
    "distortion": (
        "distortion_coefficients",
        "Distortion_Coefficients",
        "dist_coeffs",
        "distCoeffs",
        "D",
        "D1",
    ),
    "width": ("image_width", "image_Width"),
    "height": ("image_height", "image_Height"),
    "size": ("image_size", "imageSize"),
    "rotation": ("rvec", "R"),
    "translation": ("tvec", "T"),
}


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
    text = raw.decode("utf-8", "replace")
    if not text.lstrip().startswith(("%YAML", "<", "{")):
        text = f"%YAML:1.0\n---\n{text}"
    try:
        storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        root = storage.root()
        keys = {k: values for k, names in KEYS.items() if (values := _node(root, names)) is not None}
        storage.release()
    except (cv2.error, SystemError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"{path}: found a damaged OpenCV file ({reason}); valid: a whole one") from error
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
    shape = None if size is None or size.size != 2 else (int(size[0]), int(size[1]))
    return [
        Calibration(path.stem, calibration.matrix(path, "camera_matrix", matrix), distortion, shape, pose)
    ]


def _node(root: Any, names: tuple[str, ...]) -> Array | None:
    for name in names:
        node = root.getNode(name)
        if node.empty() or node.isNone():
            continue
        if node.isMap():
            if not node.getNode("dt").empty():
                return np.asarray(node.mat(), float)
            node = node.getNode("data")  # as ROS writes it: rows, cols, data
        if node.isSeq():
            return np.array([node.at(i).real() for i in range(node.size())])
        return np.array([node.real()])
    return None
