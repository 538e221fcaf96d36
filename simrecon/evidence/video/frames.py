"""The frames of a video, one at a time, upright, with their own time stamps."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from simrecon.errors import InputError
from simrecon.evidence.cutting import WHOLE, Span
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


@dataclass(frozen=True)
class Frame:
    """One frame.

    Attributes:
        row: its number in the video, from 0 on.
        stamp_s: its time stamp since that of the first frame, NaN where it has none.
        image: (H, W, 3), blue green red, upright, and valid until the next frame is asked for.
    """

    row: int
    stamp_s: float
    image: Image


def frames(
    path: Path, span: Span = WHOLE, *, fps: float | None = None, interval_s: float = 1 / 30
) -> Iterator[Frame]:
    """The frames of a video, those outside of the span left out.

    Args:
        path: of the video.
        span: by the frames' time stamps.
        fps: frame rate that takes precedence over the time stamps.
        interval_s: between frames without time stamps.

    Raises:
        InputError: it can't be opened.
    """
    capture = _open(path)
    first, begun = float("nan"), -1
    try:
        for row in itertools.count():
            if not capture.grab():
                return
            stamp = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000
            first = stamp if row == 0 else first
            since = stamp - first if np.isfinite(stamp) else float("nan")
            time = row / fps if fps is not None else since if np.isfinite(since) else row * interval_s
            if span.ended(time):
                return
            if not span.begun(time):
                continue
            begun = row if begun < 0 else begun
            if (row - begun) % span.every:
                continue
            read, image = capture.retrieve()
            if not read or image is None:
                return
            yield Frame(row, since, image.astype(np.uint8, copy=False))
    finally:
        capture.release()
