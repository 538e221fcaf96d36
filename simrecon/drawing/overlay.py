"""The simulated body drawn over the video, or over plain ground where there is none; with OpenCV alone.

Faces are sorted by distance and painted from far to near (painter's algorithm), those of the skin shaded
smoothly, and blended over the image. Left limbs are orange, right ones teal, what the scene pushes is red.
Dots: input landmarks, red to green by score. Arrows: forces from the scene on the body, half a metre per
body weight.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np

from simrecon.drawing import video
from simrecon.drawing.animation import Animation
from simrecon.drawing.canvas import Image
from simrecon.drawing.painter import Painter
from simrecon.drawing.views import View, has_view, is_placed
from simrecon.errors import InputError
from simrecon.io.messages import counted
from simrecon.types import Camera, Evidence, IntArray

__all__ = ["Animation", "check_video", "contact_sheet", "is_placed", "render", "sheet", "write"]

_SHEET_FRAMES, _SHEET_TILE_PX, _SHEET_ASPECT = 12, 300, 1.7
_LOOKED_AT = 50
"""Frames, when it is asked whether the body is in the image at all."""


def check_video(video_path: Path | str, evidence: Evidence, turn_deg: int = 0) -> None:
    """Check, before any long work, that a video can be drawn on.

    Args:
        video_path: of the video.
        evidence: at whose times its frames are taken.
        turn_deg: by which they are turned clockwise, beside what the file says.

    Raises:
        InputError: the video can't be read, ends too early or has another shape than the camera's image; or
            there is no camera.
    """
    camera = evidence.camera
    if camera is None:
        raise InputError(f"{video_path}: cannot be drawn on, for the evidence has no camera (camera_K)")
    with contextlib.closing(video.frames(video_path, evidence.times_s, evidence.part, turn_deg)) as frames:
        _check_shape(next(frames), camera)


def write(
    folder: Path | str, clip: Animation, video_path: Path | str | None = None, turn_deg: int = 0
) -> Path:
    """Write `overlay.mp4`, or `overlay.png` where there is no video or the camera is not known.

    Args:
        folder: of the result; must be there.
        clip: what to draw.
        video_path: what to draw on; frames are taken at the clip's times.
        turn_deg: by which they are turned clockwise, beside what the file says.

    Returns:
        The file written.

    Raises:
        InputError: the video can't be read, ends too early or has another shape than the camera's image; the
            body is never in it; or the overlay can't be written.
    """
    if video_path is not None and has_view(clip.camera):
        painter = Painter(clip)
        _check_seen(painter)
        path = Path(folder) / "overlay.mp4"
        frames = _painted(painter, video.frames(video_path, clip.times_s, clip.part, turn_deg))
        video.write_video(path, frames, video.rate_hz(clip.times_s))
        return path
    path = Path(folder) / "overlay.png"
    video.write_image(path, sheet(clip))
    return path


def _check_seen(painter: Painter) -> None:
    """Refuse to draw a body on a video in which it never is."""
    last = len(painter.clip.times_s) - 1
    if not painter.is_seen(np.unique(np.linspace(0, last, _LOOKED_AT).round().astype(int))):
        raise InputError(
            "the body is outside the image in all frames: the camera is not where the input has it"
        )


def render(
    clip: Animation, images: Iterable[Image | None] | None = None, max_side_px: int = 960
) -> Iterator[Image]:
    """Draw every frame.

    Args:
        clip: what to draw.
        images: one per frame, or None for plain ground.
        max_side_px: the longer side is not longer than this; both sides are even.

    Returns:
        Images (H, W, 3), blue green red, drawn as they are asked for.

    Raises:
        InputError: an image has another shape than the camera's, or there are too few images.
    """
    return _painted(Painter(clip), images, max_side_px)


def _painted(
    painter: Painter, images: Iterable[Image | None] | None = None, max_side_px: int = 960
) -> Iterator[Image]:
    """Every frame of a painter's clip; see `render`."""
    clip = painter.clip
    width, height = painter.camera.lens.image_size_px
    scale = min(1.0, max_side_px / max(width, height))
    size = (2 * max(1, round(width * scale / 2)), 2 * max(1, round(height * scale / 2)))
    view = View(np.zeros(2), np.array(size) / (width, height), size)
    if images is None:
        images = [None] * len(clip.times_s)
    drawn = 0
    for frame, image in zip(range(len(clip.times_s)), images, strict=False):
        if image is not None:
            _check_shape(image, painter.camera)
            image = cv2.resize(image, size, interpolation=cv2.INTER_AREA).astype(np.uint8, copy=False)
        yield painter.draw(frame, view, image)
        drawn += 1
    if drawn < len(clip.times_s):
        raise InputError(f"found {counted(drawn, 'image')} for {counted(len(clip.times_s), 'frame')}")


def sheet(
    clip: Animation,
    count: int = _SHEET_FRAMES,
    tile_px: int = _SHEET_TILE_PX,
    columns: int = 0,
    frames: IntArray | None = None,
) -> Image:
    """Frames side by side, each cropped around all of them, over plain ground.

    Args:
        clip: what to draw.
        count: frames at most, equally spaced.
        tile_px: width of a frame, or height over 1.6 if that is larger.
        columns: 0: for a page of a pleasant shape.
        frames: these, instead of equally spaced ones.
    """
    painter = Painter(clip)
    if frames is None:
        frames = np.unique(np.linspace(0, len(clip.times_s) - 1, count).round().astype(int))
    low, high = painter.bounds_px(frames)
    shape = high - low
    scale = tile_px / max(shape[1], shape[0] / 1.6)
    size = (max(2, round(shape[0] * scale)), max(2, round(shape[1] * scale)))
    view = View(low, np.array(size) / shape, size)
    images = [painter.draw(int(frame), view, None) for frame in frames]
    return contact_sheet(images, columns or _columns(len(images), size[0] / size[1]))


def contact_sheet(frames: Sequence[Image], columns: int, gap_px: int = 4) -> Image:
    """Images of one size side by side, row by row."""
    height, width = frames[0].shape[:2]
    rows = -(-len(frames) // columns)
    shape = (rows * (height + gap_px) + gap_px, columns * (width + gap_px) + gap_px, 3)
    page = np.full(shape, 255, np.uint8)
    for i, frame in enumerate(frames):
        y, x = (gap_px + i // columns * (height + gap_px), gap_px + i % columns * (width + gap_px))
        page[y : y + height, x : x + width] = frame
    return page


def _columns(count: int, aspect: float) -> int:
    """Number of columns for a page of a pleasant shape with few empty places."""

    def cost(columns: int) -> float:
        rows = -(-count // columns)
        empty = rows * columns - count
        return abs(float(np.log(aspect * columns / rows / _SHEET_ASPECT))) + empty / count

    return min(range(1, count + 1), key=cost)


def _check_shape(image: Image, camera: Camera) -> None:
    width, height = camera.lens.image_size_px
    found_height, found_width = image.shape[:2]
    if abs(found_width / found_height * height / width - 1) > 0.02:
        raise InputError(
            f"the video is {found_width} x {found_height} pixels, but the evidence's image_size_px is "
            f"{width} x {height}: the aspect ratio must be the same"
        )
