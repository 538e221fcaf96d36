"""A video as OpenCV opens it, and how its images become upright with square pixels."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from simrecon.errors import InputError
from simrecon.evidence.video import codecs
from simrecon.evidence.video.blazepose import Image
from simrecon.io.paths import plain

# FFmpeg, within OpenCV, would write lines of its own beside our errors; it looks at this when first used.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

TURNS = {90: cv2.ROTATE_90_CLOCKWISE, 180: cv2.ROTATE_180, 270: cv2.ROTATE_90_COUNTERCLOCKWISE}
ASPECT_RANGE = (0.2, 5.0)
ASPECT_ERROR = 1e-3
"""Pixels that are so nearly square are square."""


@dataclass(frozen=True)
class Form:
    """How decoded images become upright.

    Attributes:
        rotation_deg: by which the decoder has turned them clockwise, as the file says.
        aspect: width of a pixel over its height, as the file says, before it was turned.
        turn_deg: by which they are turned clockwise after that, as the user says.
    """

    rotation_deg: int = 0
    aspect: float = 1.0
    turn_deg: int = 0

    def size_px(self, width: int, height: int) -> tuple[int, int]:
        """Width and height of the upright image of a decoded one."""
        if self.rotation_deg % 180:
            height = round(height * self.aspect)
        else:
            width = round(width * self.aspect)
        return (height, width) if self.turn_deg % 180 else (width, height)

    def upright(self, image: Image) -> Image:
        """A decoded image (H, W, 3), upright and with square pixels."""
        if self.aspect != 1.0:
            size = Form(self.rotation_deg, self.aspect).size_px(image.shape[1], image.shape[0])
            image = cv2.resize(image, size, interpolation=cv2.INTER_LINEAR).astype(np.uint8, copy=False)
        if self.turn_deg:
            image = cv2.rotate(image, TURNS[self.turn_deg]).astype(np.uint8, copy=False)
        return image


def open_video(path: Path) -> cv2.VideoCapture:
    """Open a video, whose images come turned as the file says.

    FFmpeg alone is asked: OpenCV's other readers print names as they are, and take some for patterns.

    Raises:
        InputError: it is not there, or can't be opened.
    """
    if not path.is_file():
        raise InputError(f"{path}: there is no such video")
    with plain(path) as name, _silent():
        capture = cv2.VideoCapture(name, cv2.CAP_FFMPEG)
    if not capture.isOpened():
        raise codecs.unreadable(path, "a file that cannot be opened as a video")
    capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 1)
    return capture


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """OpenCV writes no lines of its own beside our errors."""
    before = cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        cv2.utils.logging.setLogLevel(before)


def form(capture: cv2.VideoCapture, turn_deg: int = 0) -> Form:
    """What the file says of its images, and the user beside it."""
    rotation = int(capture.get(cv2.CAP_PROP_ORIENTATION_META)) % 360
    wide, high = capture.get(cv2.CAP_PROP_SAR_NUM), capture.get(cv2.CAP_PROP_SAR_DEN)
    aspect = wide / high if wide > 0 and high > 0 else 1.0
    known = ASPECT_RANGE[0] <= aspect <= ASPECT_RANGE[1] and abs(aspect - 1) > ASPECT_ERROR
    return Form(rotation, aspect if known else 1.0, turn_deg)
