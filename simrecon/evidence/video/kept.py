"""Landmarks that were found in a video, as a file in the cache."""

from __future__ import annotations

import contextlib
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simrecon.errors import InputError
from simrecon.evidence.camera.turning import Views
from simrecon.evidence.video.blazepose import COUNT
from simrecon.io import atomic
from simrecon.io.arrays import Arrays
from simrecon.io.npz import parse_npz
from simrecon.io.reading import read_bytes
from simrecon.types import Array, IntArray

SCHEMA = "simrecon.detection/3"


@dataclass(frozen=True)
class Detection:
    """Landmarks of a video; (0, 0) is the centre of the first pixel.

    Attributes:
        stamps_s: (T,) time stamps of the frames since the video's first, NaN where the file has none.
        rows: (T,) numbers of the frames in the video.
        points_px: (T, 33, 2), NaN where the person is unseen.
        scores: (T, 33), visibility × presence.
        world_m: (T, 33, 3) around the middle of the hips, axes of the camera; NaN where the person is unseen
            or hidden.
        swapped: (T, 2) left and right were exchanged by us, arms and legs.
        frame_ms: (T,) time spent on each frame, decoding included.
        sightings: (M, 6) row, index of the person, x0 y0 x1 y1, of everybody in the frames that were looked
            at before (`survey`), the people who are seen best first.
        looked: (S,) numbers of these frames.
        chosen: index of the person who was followed; -1: one who is in none of these frames.
        losses: how often the person was lost.
        backward: number of frames whose landmarks are of the pass backward in time.
        homographies: (T, 3, 3) from pixels of the first frame to those of each, of the background.
        background: (T,) share of the background's features that agree with it; 0 where it is not known.
        size_px: (2,) width and height of the upright image.
    """

    stamps_s: Array
    rows: IntArray
    points_px: Array
    scores: Array
    world_m: Array
    swapped: NDArray[np.bool_]
    frame_ms: Array
    sightings: Array
    looked: IntArray
    chosen: int
    losses: int
    backward: int
    homographies: Array
    background: Array
    size_px: tuple[int, int]

    @property
    def views(self) -> Views:
        """What the background did."""
        return Views(self.homographies, self.background)

    @property
    def seen(self) -> NDArray[np.bool_]:
        """(T,) whether the person was seen."""
        return np.asarray(np.isfinite(self.points_px).all(axis=(1, 2)))

    @property
    def hidden(self) -> NDArray[np.bool_]:
        """(T,) whether the person is hidden, and only known to be on the way from one place to another."""
        return np.asarray(self.seen & np.isnan(self.world_m).all(axis=(1, 2)))


def save(path: Path, detection: Detection) -> None:
    """Write a detection; a cache that can't be written is no error, for the result does not need it."""
    content: dict[str, Any] = {"schema": SCHEMA, **asdict(detection)}
    for large in ("points_px", "scores", "world_m", "frame_ms"):
        content[large] = content[large].astype(np.float32)
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        atomic.write_npz(path, content)


def load(path: Path) -> Detection | None:
    """A detection out of the cache; None where there is none, or a damaged one."""
    try:
        arrays = parse_npz(str(path), read_bytes(path))
        return _parse(arrays)
    except (OSError, InputError):
        return None


def _parse(arrays: Arrays) -> Detection:
    arrays.text("schema", (SCHEMA,))
    size = arrays.finite("size_px", (2,))
    return Detection(
        stamps_s=arrays.floats("stamps_s", ("T",)),
        rows=arrays.finite("rows", ("T",)).astype(np.int64),
        points_px=arrays.floats("points_px", ("T", COUNT, 2)),
        scores=arrays.finite("scores", ("T", COUNT)),
        world_m=arrays.floats("world_m", ("T", COUNT, 3)),
        swapped=arrays.array("swapped").astype(bool),
        frame_ms=arrays.finite("frame_ms", ("T",)),
        sightings=arrays.finite("sightings", ("M", 6)),
        looked=arrays.finite("looked", ("S",)).astype(np.int64),
        chosen=int(arrays.finite("chosen", ())),
        losses=int(arrays.finite("losses", ())),
        backward=int(arrays.finite("backward", ())),
        homographies=arrays.finite("homographies", ("T", 3, 3)),
        background=arrays.finite("background", ("T",)),
        size_px=(int(size[0]), int(size[1])),
    )
