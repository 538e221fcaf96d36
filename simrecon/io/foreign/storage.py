"""OpenCV's FileStorage, in a process of its own: cameras in YAML, XML or JSON."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

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
"""What is read, and the names that OpenCV's samples and ROS give it."""


def parse(path: str) -> dict[str, NDArray[Any]]:
    """The arrays of `KEYS` that a file has; those of its sequences have one axis."""
    text = Path(path).read_bytes().decode("utf-8", "replace")
    if not text.lstrip().startswith(("%YAML", "<", "{")):
        text = f"%YAML:1.0\n---\n{text}"
    storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    root = storage.root()
    found = {key: values for key, names in KEYS.items() if (values := _node(root, names)) is not None}
    storage.release()
    return found


def _node(root: Any, names: tuple[str, ...]) -> NDArray[Any] | None:
    for name in names:
        node = root.getNode(name)
        if node.empty() or node.isNone():
            continue
        if node.isMap():
            if not node.getNode("dt").empty():
                return np.asarray(node.mat(), float)
            node = node.getNode("data")  # as ROS writes it: rows, cols, data
        if node.isSeq():
            return np.array([node.at(i).real() for i in range(node.size())], float)
        return np.array([node.real()])
    return None
