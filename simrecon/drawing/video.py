"""Reading and writing of videos and images with OpenCV."""

from __future__ import annotations

from collections.abc import Generator, Iterable
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from simrecon.errors import InputError
from simrecon.evidence.video import opening
from simrecon.evidence.video.opening import Form
from simrecon.io import atomic
from simrecon.io.messages import counted
from simrecon.io.paths import plain
from simrecon.types import Array, IntArray, Part

Image = NDArray[np.uint8]


def rate_hz(times_s: Array) -> float:
    """Mean frame rate of (T,) times; 30 for a single frame."""
    return float((len(times_s) - 1) / (times_s[-1] - times_s[0])) if len(times_s) > 1 else 30.0


def check_video(path: Path | str, times_s: Array) -> None:
    """Check that a video can be opened and reaches to the last of (T,) times; see `frames`.

    Raises:
        InputError: it can't or doesn't.
    """
    _open(path, times_s, None)[0].release()


def frames(
    path: Path | str, times_s: Array, part: Part | None = None, turn_deg: int = 0
) -> Generator[Image, None, None]:
    """Frames of a video at given times.

    Where the video has as many frames as there are times, or as the source that they are a part of, they are
    taken one to one; else by the frame rate.

    Args:
        path: of the video.
        times_s: (T,) increasing, from the start of the video.
        part: which frames of their source these times are of; None: all.
        turn_deg: by which images are turned clockwise, beside what the file says.

    Returns:
        T images (H, W, 3), blue green red, upright, with square pixels.

    Raises:
        InputError: the video can't be opened, or ends too early; the first is found at once.
    """
    capture, indices = _open(path, times_s, part)
    return _decode(path, capture, indices, opening.form(capture, turn_deg))


def write_video(path: Path | str, images: Iterable[Image], fps: float) -> None:
    """Write an MPEG-4 video; the file is replaced at once.

    Args:
        path: ends in `.mp4`.
        images: (H, W, 3) of one size, blue green red.
        fps: frame rate.

    Raises:
        InputError: it can't be written.
    """
    path = Path(path)
    with atomic.reported(path), atomic.beside(path) as partial, plain(partial) as name:
        _encode(name, path, images, fps)


def _encode(name: str, path: Path, images: Iterable[Image], fps: float) -> None:
    writer: cv2.VideoWriter | None = None
    try:
        for image in images:
            if writer is None:
                size = (image.shape[1], image.shape[0])
                writer = cv2.VideoWriter(name, cv2.VideoWriter.fourcc(*"mp4v"), fps, size)
                if not writer.isOpened():
                    raise InputError(f"{path}: cannot write the video: is the folder there and writable?")
            writer.write(image)
    finally:
        if writer is not None:
            writer.release()
    if writer is None:
        raise InputError(f"{path}: there are no frames to write")


def write_image(path: Path | str, image: Image) -> None:
    """Write an image; the suffix sets the format, and the file is replaced at once.

    Raises:
        InputError: it can't be written.
    """
    with atomic.reported(path):
        atomic.write_bytes(path, cv2.imencode(Path(path).suffix, image)[1].tobytes())


def _open(path: Path | str, times_s: Array, part: Part | None) -> tuple[cv2.VideoCapture, IntArray]:
    """The open video and the indices (T,) of its frames at the times."""
    capture = opening.open_video(Path(path))
    count, fps = int(capture.get(cv2.CAP_PROP_FRAME_COUNT)), capture.get(cv2.CAP_PROP_FPS)
    rows = np.arange(len(times_s)) if part is None else part.first + part.every * np.arange(len(times_s))
    whole = len(times_s) if part is None else part.count
    by_time = count != whole and fps > 0
    indices = np.maximum(np.rint(times_s * fps).astype(np.int64), 0) if by_time else rows
    if 0 < count <= indices[-1]:
        capture.release()
        raise InputError(_too_short(path, count, int(indices[-1]) + 1))
    return capture, indices


def _decode(
    path: Path | str, capture: cv2.VideoCapture, indices: IntArray, form: Form
) -> Generator[Image, None, None]:
    position, image = -1, None
    try:
        for index in indices:
            while position < index:
                more, image = capture.read()
                if not more:
                    raise InputError(_too_short(path, position + 1, int(indices[-1]) + 1))
                position += 1
            if image is not None:
                yield form.upright(image.astype(np.uint8, copy=False))
    finally:
        capture.release()


def _too_short(path: Path | str, count: int, needed: int) -> str:
    return f"{path}: the video has {counted(count, 'frame')}, but the evidence reaches to frame {needed}"
