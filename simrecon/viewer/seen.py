"""The camera of a result as WebGL has it: y up, looking along -z."""

from __future__ import annotations

from typing import Any

import numpy as np

from simrecon.exports.axes import TO_Y_UP
from simrecon.types import IntArray, Report
from simrecon.viewer.curves import rounded

_TURN = np.diag([1.0, -1.0, -1.0])
"""OpenCV's camera (x right, y down, z forward) to WebGL's (x right, y up, z backward)."""


def make(report: Report, rows: IntArray, count: int) -> dict[str, Any] | None:
    """Size, focal lengths and centre (px) of the image, and `views` (1 or F, 12), world → camera by rows.

    Args:
        report: of a result.
        rows: (F,) frames that are shown, of so many.
        count: frames of the motion.

    Returns:
        None where the report says nothing of the camera, as those of earlier versions.
    """
    camera = report.get("camera")
    if camera is None:
        return None
    path = np.array(camera["world_to_camera"], float)  # (1 or T, 3, 4)
    if len(path) not in (1, count):
        return None
    views = path if len(path) == 1 else path[rows]
    turned = np.concatenate((_TURN @ views[:, :, :3] @ TO_Y_UP.T, _TURN @ views[:, :, 3:]), axis=2)
    matrix = np.array(camera["K"], float)
    return {
        "size_px": list(camera["image_size_px"]),
        "focal_px": [matrix[0, 0], matrix[1, 1]],
        "centre_px": [matrix[0, 2] + 0.5, matrix[1, 2] + 0.5],
        "views": rounded(turned.reshape(len(turned), -1), 6),
    }
