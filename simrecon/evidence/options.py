"""What the user says of a file that the file itself does not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simrecon.errors import InputError
from simrecon.evidence.cutting import WHOLE, Span
from simrecon.types import Array, Camera

FRAMES = ("world", "camera")
POINTS = ("joints", "markers")


@dataclass(frozen=True)
class Options:
    """What the user says of a file; None = what the file says, or an error if it says nothing.

    Attributes:
        format: name of a reader.
        up: axis of the file that points up, one of `AXES`.
        unit: of lengths, one of `UNITS_M`, or metres in one.
        height_m: of the person; tells the unit where nothing else does.
        joints: of a hierarchy, `ours=theirs` each, where they aren't found.
        frame: `world` or `camera`, for files that hold both.
        person: which one, as the file names it.
        points: what the points of a TRC or C3D file are, one of `POINTS`.
        layout: of landmarks without names, one of `layouts.all_names()`.
        fps: frame rate, Hz; takes precedence over that of the file.
        video_fps: frame rate of the video, for files without one.
        camera: the lens, for files with landmarks only and videos; with a path of one frame where it is known
            where the camera stands.
        lens: where that is from, for the reading.
        size_px: width and height of the images, as a video or the user tells; some lenses follow from it.
        landmarks: whether those of another file go with it, which then place a camera that stands still.
        person_at: a place in the image, x and y in pixels, where the person is; for videos.
        model: of the pose network, for videos; the best one that is there if None.
        turn_deg: by which the image is turned clockwise to be upright; lens, size and place in the image that
            the user gives are of the upright one.
        aspect: width of a pixel over its height in the image of landmarks; those of a video are found in one
            with square pixels.
        span: which part of the file is asked for, in the times that its frames have under these options.
        progress: told how many frames of a video are done, and how many there are.
    """

    format: str | None = None
    up: str | None = None
    unit: str | float | None = None
    height_m: float | None = None
    joints: tuple[str, ...] = ()
    frame: str | None = None
    person: str | None = None
    points: str | None = None
    layout: str | None = None
    fps: float | None = None
    video_fps: float | None = None
    camera: Camera | None = None
    lens: str = "as given"
    size_px: tuple[int, int] | None = None
    landmarks: bool = False
    person_at: tuple[float, float] | None = None
    model: str | None = None
    turn_deg: int | None = None
    aspect: float = 1.0
    span: Span = WHOLE
    progress: Callable[[float, float], None] | None = None

    @property
    def rate_hz(self) -> float | None:
        """The frame rate of a file that has none."""
        return self.video_fps if self.fps is None else self.fps


def place(text: str) -> tuple[float, float] | None:
    """A place in the image, pixels, from text such as `640,360`; None if it is none."""
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        return None
    return (x, y) if 0 <= x < np.inf and 0 <= y < np.inf else None


def times_s(source: str, frames: NDArray[Any], fps: float | None) -> Array:
    """Times of frame numbers (T,) at a frame rate.

    Raises:
        InputError: no frame rate.
    """
    if fps is None:
        valid = "--fps N, or --video FILE to take it from there"
        raise InputError(f"{source}: frame rate: found none in the file; valid: {valid}")
    times: Array = np.asarray(frames, float) / fps
    return times
