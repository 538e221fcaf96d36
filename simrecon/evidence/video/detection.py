"""One person's landmarks in every frame of a video, kept in the cache: a second run skips the networks."""

from __future__ import annotations

import contextlib
import hashlib
import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simrecon.errors import InputError
from simrecon.evidence.video import frames, swaps, tracker, weights
from simrecon.evidence.video.blazepose import COUNT, Image, Pose
from simrecon.evidence.video.networks import Networks
from simrecon.evidence.video.tracker import Choice, Tracker
from simrecon.io import atomic
from simrecon.io.arrays import Arrays
from simrecon.io.messages import counted
from simrecon.io.npz import parse_npz
from simrecon.types import Array

SCHEMA = "simrecon.detection/1"
# Of what turns frames into landmarks: raised by every change of it, so that older caches are not used.
VERSION = 1
BODY_M = 2.2  # side of a person's region, about
PEOPLE_MAX = 32
_ROWS = 2048

Progress = Callable[[float, float], None]


@dataclass(frozen=True)
class Detection:
    """Landmarks of a video; (0, 0) is the centre of the first pixel.

    Attributes:
        stamps_s: (T,) time stamps of the frames, NaN where the file has none.
        points_px: (T, 33, 2), NaN where the person is unseen.
        scores: (T, 33), visibility × presence.
        world_m: (T, 33, 3) around the middle of the hips, axes of the camera.
        swapped: (T, 2) left and right were exchanged by us, arms and legs.
        frame_ms: (T,) time spent on each frame, decoding included.
        people_px: (N, 4) x0 y0 x1 y1 of the people in the frame of the choice, the largest first.
        chosen: index of the person in it.
        losses: how often the person was lost.
        size_px: (2,) width and height of the upright image.
    """

    stamps_s: Array
    points_px: Array
    scores: Array
    world_m: Array
    swapped: NDArray[np.bool_]
    frame_ms: Array
    people_px: Array
    chosen: int
    losses: int
    size_px: tuple[int, int]

    @property
    def seen(self) -> NDArray[np.bool_]:
        """(T,) whether the person was seen."""
        return np.asarray(np.isfinite(self.points_px).all(axis=(1, 2)))


def key(content_sha256: str, model: str, hashes: tuple[str, ...], choice: Choice) -> str:
    """Name of a detection in the cache: hash of the video's content, the networks and the options."""
    told = {
        "version": VERSION, "content": content_sha256, "model": model, "weights": list(hashes),
        "choice": asdict(choice),
    }  # fmt: skip
    return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()


def detect(
    path: Path, content_sha256: str, model: str, choice: Choice, progress: Progress | None = None
) -> tuple[Detection, bool]:
    """The landmarks of one person.

    Args:
        path: of the video.
        content_sha256: of its bytes.
        model: one of `weights.MODELS`.
        choice: whom to follow.
        progress: told the number of frames done and of all.

    Returns:
        The detection, and whether it came out of the cache.

    Raises:
        InputError: weights are missing or damaged, the extra is missing, the video can't be read, or the
            person asked for isn't in it.
    """
    detector, detector_hash = weights.find("detector")
    landmarks, landmarks_hash = weights.find(model)
    name = key(content_sha256, model, (detector_hash, landmarks_hash), choice)
    kept = weights.cache_folder() / "detections" / f"{name}.npz"
    if (known := load(kept)) is not None:
        return known, True
    detection = follow(path, Networks(detector, landmarks), choice, progress)
    save(kept, detection)
    return detection, False


class _Rows:
    """Arrays that grow by blocks: an hour of video takes the memory of its landmarks alone."""

    def __init__(self) -> None:
        self._blocks: list[NDArray[np.float32]] = []
        self._count = 0

    def add(self, pose: Pose | None) -> None:
        if self._count % _ROWS == 0:
            self._blocks.append(np.full((_ROWS, COUNT, 6), np.nan, np.float32))
        if pose is not None:
            row = self._blocks[-1][self._count % _ROWS]
            row[:, :2], row[:, 2], row[:, 3:] = pose.points_px - 0.5, pose.scores, pose.world_m
        self._count += 1

    def array(self) -> NDArray[np.float32]:
        """(T, 33, 6): x, y, score, x, y, z."""
        whole: NDArray[np.float32] = np.concatenate([*self._blocks, np.empty((0, COUNT, 6), np.float32)])
        return whole[: self._count]


def follow(
    path: Path, network: tracker.Network, choice: Choice, progress: Progress | None = None
) -> Detection:
    """Follow one person through all frames, and put left and right in order.

    Raises:
        InputError: as `detect`.
    """
    info = frames.probe(path)
    follower = Tracker(network, choice)
    rows, stamps, spent, regions = _Rows(), [], [], []
    interval = 1.0 / (info.rate_hz or 30.0)
    clock = -interval
    began = time.perf_counter()
    for stamp, image in frames.frames(path):
        _check_size(path, image, info.size_px)
        clock = stamp if stamp > clock else clock + interval
        pose = follower.step(image, clock)
        rows.add(pose)
        stamps.append(stamp)
        regions.append(np.nan if pose is None else pose.region.side_px)
        now = time.perf_counter()
        spent.append(1000 * (now - began))
        began = now
        if progress is not None:
            progress(len(stamps), max(info.count, len(stamps)))
    if follower.chosen < 0:
        raise _nobody(path, follower, choice, len(stamps), info.count)
    values = rows.array().astype(float)
    points, scores, world = values[..., :2], np.nan_to_num(values[..., 2]), values[..., 3:]
    scale = np.asarray(regions) / BODY_M
    swapped = swaps.find(_increasing(np.asarray(stamps), interval), points, scores, world, scale)
    return Detection(
        np.asarray(stamps),
        swaps.exchange(points, swapped),
        swaps.exchange(scores, swapped),
        swaps.exchange(world, swapped),
        swapped,
        np.asarray(spent),
        np.array([tracker.bounds(pose) for pose in follower.first[:PEOPLE_MAX]]),
        follower.chosen,
        follower.losses,
        info.size_px,
    )


def _increasing(stamps: Array, interval: float) -> Array:
    """Time stamps where they increase, else a constant rate."""
    if np.isfinite(stamps).all() and (np.diff(stamps) > 0).all():
        return stamps
    return np.asarray(interval * np.arange(len(stamps)), float)


def _check_size(path: Path, image: Image, size: tuple[int, int]) -> None:
    if (image.shape[1], image.shape[0]) != size:
        sizes = f"frames of {size[0]} x {size[1]} and of {image.shape[1]} x {image.shape[0]} px"
        raise InputError(f"{path}: found {sizes}; valid: one size")


def _nobody(path: Path, follower: Tracker, choice: Choice, count: int, told: int) -> InputError:
    if count == 0:
        return InputError(f"{path}: found no frame that can be decoded; valid: a whole video")
    there = described(np.array([tracker.bounds(pose) for pose in follower.first]))
    if choice.at_px is not None and there:
        where = f"found no person at {choice.at_px[0]:g},{choice.at_px[1]:g}"
        return InputError(
            f"{path}: --person-at: {where} in {counted(count, 'frame')}; valid: a place on one of {there}"
        )
    if choice.number is not None and there:
        people = f"at most {len(follower.first)} people at a time"
        return InputError(f"{path}: --person {choice.number}: found {people}: {there}")
    damaged = f", of {told}: the rest cannot be decoded" if count < told else ""
    nobody = f"found no person in {counted(count, 'frame')}{damaged}"
    return InputError(f"{path}: people: {nobody}; valid: a video that shows a person")


def described(people_px: Array) -> str:
    """People by number and middle of their landmarks, for messages."""
    boxes = people_px.reshape(-1, 4)
    return ", ".join(
        f"{i + 1} (at {(b[0] + b[2]) / 2:.0f},{(b[1] + b[3]) / 2:.0f}, {b[3] - b[1]:.0f} px high)"
        for i, b in enumerate(boxes)
    )


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
        arrays = parse_npz(str(path), path.read_bytes())
        return _parse(arrays)
    except (OSError, InputError):
        return None


def _parse(arrays: Arrays) -> Detection:
    arrays.text("schema", (SCHEMA,))
    size = arrays.finite("size_px", (2,))
    return Detection(
        stamps_s=arrays.floats("stamps_s", ("T",)),
        points_px=arrays.floats("points_px", ("T", COUNT, 2)),
        scores=arrays.finite("scores", ("T", COUNT)),
        world_m=arrays.floats("world_m", ("T", COUNT, 3)),
        swapped=arrays.array("swapped").astype(bool),
        frame_ms=arrays.finite("frame_ms", ("T",)),
        people_px=arrays.finite("people_px", ("N", 4)),
        chosen=int(arrays.finite("chosen", ())),
        losses=int(arrays.finite("losses", ())),
        size_px=(int(size[0]), int(size[1])),
    )
