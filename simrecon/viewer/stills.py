"""Frames of the overlay for the page, as small JPEGs: browsers do not play its MPEG-4."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from simrecon.drawing import canvas
from simrecon.errors import InputError
from simrecon.evidence.video import opening
from simrecon.types import IntArray

VIDEO = "overlay.mp4"
COUNT_MAX, SIDE_PX, QUALITY = 120, 540, 72
BYTES_MAX = 1_200_000
"""Of all stills together: beyond it fewer are taken."""


def make(folder: Path, rows: IntArray) -> list[dict[str, Any]]:
    """Stills of a result's overlay.

    Args:
        folder: of the result.
        rows: (F,) frames of the motion that the page shows.

    Returns:
        `frame`, counted among those that are shown, and `image`, a data URL; none without the video.
    """
    wanted = np.unique(np.linspace(0, len(rows) - 1, COUNT_MAX).round().astype(int))
    taken = _read(folder / VIDEO, {int(rows[shown]): int(shown) for shown in wanted})
    total = sum(len(image) for _, image in taken)
    if total > BYTES_MAX:
        keep = max(2, int(len(taken) * BYTES_MAX / total))
        taken = [taken[i] for i in np.unique(np.linspace(0, len(taken) - 1, keep).round().astype(int))]
    return [
        {"frame": shown, "image": "data:image/jpeg;base64," + base64.b64encode(image).decode()}
        for shown, image in taken
    ]


def _read(path: Path, wanted: dict[int, int]) -> list[tuple[int, bytes]]:
    """JPEGs of frames of a video, with what each is called by."""
    taken: list[tuple[int, bytes]] = []
    try:
        capture = opening.open_video(path)
    except InputError:
        return []
    try:
        for position in range(max(wanted) + 1):
            if position not in wanted:
                if not capture.grab():
                    break
                continue
            more, image = capture.read()
            if not more:
                break
            taken.append((wanted[position], _jpeg(image.astype(np.uint8, copy=False))))
    finally:
        capture.release()
    return taken


def _jpeg(image: canvas.Image) -> bytes:
    height, width = image.shape[:2]
    scale = min(1.0, SIDE_PX / max(width, height))
    small = cv2.resize(
        image, (max(1, round(width * scale)), max(1, round(height * scale))), interpolation=cv2.INTER_AREA
    )
    return cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1].tobytes()
