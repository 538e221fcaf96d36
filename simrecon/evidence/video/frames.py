"""The frames of a video, one at a time, upright, with their own time stamps."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from simrecon.errors import InputError
from simrecon.evidence.cutting import WHOLE, Span
from simrecon.evidence.video import codecs
from simrecon.evidence.video.blazepose import Image
from simrecon.evidence.video.opening import Form, form, open_video

RATE_RANGE_HZ = (2.0, 2000.0)


@dataclass(frozen=True)
class Info:
    """What a video says of itself.

    Attributes:
        size_px: width and height of the upright image, with square pixels.
        decoded_px: the same of images as they are decoded.
        form: how these become upright.
        rate_hz: mean frame rate, None if it says none that can be true.
        count: number of frames, 0 if it does not say.
    """

    size_px: tuple[int, int]
    decoded_px: tuple[int, int]
    form: Form
    rate_hz: float | None
    count: int


def probe(path: Path, turn_deg: int = 0) -> Info:
    """Size, rate and number of frames; two of them are decoded, since containers are wrong at times.

    Args:
        path: of the video.
        turn_deg: by which the user wants it turned clockwise.

    Raises:
        InputError: it can't be opened, or has fewer than two frames.
    """
    capture = open_video(path)
    try:
        rate, count = capture.get(cv2.CAP_PROP_FPS), capture.get(cv2.CAP_PROP_FRAME_COUNT)
        how = form(capture, turn_deg)
        read, image = capture.read()
        more = read and capture.grab()
    finally:
        capture.release()
    if not read:
        raise codecs.unreadable(path, "no frame that can be decoded")
    if not more:
        after = f" of {count:.0f}: the rest cannot be decoded" if 1 < count < 1e9 else ""
        raise InputError(f"{path}: frames: found a single frame{after}; valid: a video of two frames or more")
    low, high = RATE_RANGE_HZ
    known = rate if np.isfinite(rate) and low <= rate <= high else None
    count = int(count) if np.isfinite(count) and 0 < count < 1e9 else 0
    decoded = (image.shape[1], image.shape[0])
    return Info(how.size_px(*decoded), decoded, how, known, count)


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
    path: Path,
    span: Span = WHOLE,
    *,
    fps: float | None = None,
    interval_s: float = 1 / 30,
    turn_deg: int = 0,
) -> Iterator[Frame]:
    """The frames of a video, those outside of the span left out.

    Args:
        path: of the video.
        span: by the frames' time stamps.
        fps: frame rate that takes precedence over the time stamps.
        interval_s: between frames without time stamps.
        turn_deg: by which images are turned clockwise, beside what the file says.

    Raises:
        InputError: it can't be opened.
    """
    capture = open_video(path)
    how = form(capture, turn_deg)
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
            yield Frame(row, since, how.upright(image.astype(np.uint8, copy=False)))
    finally:
        capture.release()
