"""The frames of a video, one at a time, upright, with their own time stamps."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from simrecon.errors import InputError
from simrecon.evidence.video.blazepose import Image

# FFmpeg, within OpenCV, would write lines of its own beside our errors; it looks at this when first used.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

RATE_RANGE_HZ = (2.0, 2000.0)


@dataclass(frozen=True)
class Info:
    """What a video says of itself.

    Attributes:
        size_px: width and height of the upright image.
        rotation_deg: by which the stored image is turned clockwise to be upright.
        rate_hz: mean frame rate, None if it says none that can be true.
        count: number of frames, 0 if it does not say.
    """

    size_px: tuple[int, int]
    rotation_deg: int
    rate_hz: float | None
    count: int


def _open(path: Path) -> cv2.VideoCapture:
    if not path.is_file():
        raise InputError(f"{path}: there is no such video")
    capture = cv2.VideoCapture(str(path))
    if not capture.isOpened():
        raise InputError(f"{path}: cannot be opened as a video; valid: one that FFmpeg reads, such as .mp4")
    capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 1)
    return capture


def probe(path: Path) -> Info:
    """Size, rate and number of frames; one frame is decoded, since containers are wrong about sizes at times.

    Raises:
        InputError: it can't be opened, or has no frames.
    """
    capture = _open(path)
    try:
        rate, count = capture.get(cv2.CAP_PROP_FPS), capture.get(cv2.CAP_PROP_FRAME_COUNT)
        rotation = int(capture.get(cv2.CAP_PROP_ORIENTATION_META)) % 360
        read, image = capture.read()
    finally:
        capture.release()
    if not read:
        raise InputError(f"{path}: found no frame that can be decoded; valid: a whole video")
    low, high = RATE_RANGE_HZ
    known = rate if np.isfinite(rate) and low <= rate <= high else None
    count = int(count) if np.isfinite(count) and 0 < count < 1e9 else 0
    return Info((image.shape[1], image.shape[0]), rotation, known, count)


def frames(path: Path) -> Iterator[tuple[float, Image]]:
    """Every frame of a video: its time stamp in seconds, NaN where it has none, and its image.

    Images are (H, W, 3), blue green red, upright, and valid until the next one is asked for.

    Raises:
        InputError: it can't be opened.
    """
    capture = _open(path)
    try:
        while True:
            read, image = capture.read()
            if not read or image is None:
                return
            stamp = capture.get(cv2.CAP_PROP_POS_MSEC)
            yield stamp / 1000 if np.isfinite(stamp) else float("nan"), image.astype(np.uint8, copy=False)
    finally:
        capture.release()
