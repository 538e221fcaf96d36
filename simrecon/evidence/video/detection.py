"""One person's landmarks in every frame of a video, kept in the cache: a second run skips the networks."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simrecon.errors import InputError
from simrecon.evidence import cutting
from simrecon.evidence.cutting import WHOLE, Span
from simrecon.evidence.video import figures, frames, jumps, searching, swaps, weights
from simrecon.evidence.video import survey as surveys
from simrecon.evidence.video.background import Background
from simrecon.evidence.video.blazepose import COUNT, Image, Pose
from simrecon.evidence.video.kept import Detection, load, save
from simrecon.evidence.video.networks import Networks
from simrecon.evidence.video.passes import Passes
from simrecon.evidence.video.survey import Sighting, Survey
from simrecon.evidence.video.tracker import ANYBODY, Choice, Tracker
from simrecon.io.messages import counted
from simrecon.types import Array

# Of what turns frames into landmarks: raised by every change of it, so that older caches are not used.
VERSION = 7
BODY_M = 2.2  # side of a person's region, about
PEOPLE_MAX = 32
_ROWS = 2048

Progress = Callable[[float, float], None]


@dataclass(frozen=True)
class Look:
    """Whom to look for, and in which frames.

    Attributes:
        choice: whom to follow.
        span: frames to look at.
        fps: frame rate that counts instead of the time stamps.
        turn_deg: by which images are turned clockwise, beside what the file says.
    """

    choice: Choice = ANYBODY
    span: Span = WHOLE
    fps: float | None = None
    turn_deg: int = 0


def key(content_sha256: str, model: str, hashes: tuple[str, ...], look: Look) -> str:
    """Name of a detection in the cache: hash of the video's content, the networks and the options."""
    told = {
        "version": VERSION, "content": content_sha256, "model": model, "weights": list(hashes),
        "look": asdict(look if not look.span.is_all else replace(look, fps=None)),
    }  # fmt: skip
    return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()


def detect(
    path: Path, content_sha256: str, model: str, look: Look, progress: Progress | None = None
) -> tuple[Detection, bool]:
    """The landmarks of one person.

    Args:
        path: of the video.
        content_sha256: of its bytes.
        model: one of `weights.MODELS`.
        look: whom to follow, and in which frames.
        progress: told the number of frames done and of all.

    Returns:
        The detection, and whether it came out of the cache.

    Raises:
        InputError: weights are missing or damaged, the extra is missing, the video can't be read, or the
            person asked for isn't in it.
    """
    detector, detector_hash = weights.find("detector")
    landmarks, landmarks_hash = weights.find(model)
    name = key(content_sha256, model, (detector_hash, landmarks_hash), look)
    kept = weights.cache_folder() / "detections" / f"{name}.npz"
    if (known := load(kept)) is not None:
        return known, True
    detection = follow(path, Networks(detector, landmarks), look, progress)
    save(kept, detection)
    return detection, False


class _Rows:
    """Arrays that grow by blocks: an hour of video takes the memory of its landmarks alone."""

    def __init__(self) -> None:
        self._blocks: list[NDArray[np.float32]] = []
        self.count = 0

    def set(self, poses: Mapping[int, Pose | None]) -> None:
        """Poses by index of the frame: of the next one, and of some before it."""
        for index, pose in poses.items():
            if index == _ROWS * len(self._blocks):
                self._blocks.append(np.full((_ROWS, COUNT, 7), np.nan, np.float32))
            self.count = max(self.count, index + 1)
            if pose is not None:
                row = self._blocks[index // _ROWS][index % _ROWS]
                row[:, :2], row[:, 2], row[:, 3:6] = pose.points_px - 0.5, pose.scores, pose.world_m
                row[:, 6] = pose.region.side_px

    def array(self) -> NDArray[np.float32]:
        """(T, 33, 7): x, y, score, x, y, z, side of the region."""
        whole: NDArray[np.float32] = np.concatenate([*self._blocks, np.empty((0, COUNT, 7), np.float32)])
        return whole[: self.count]


def follow(path: Path, network: searching.Network, look: Look, progress: Progress | None = None) -> Detection:
    """Find out who is there, follow one person through the frames, and put left and right in order.

    Raises:
        InputError: as `detect`.
    """
    info = frames.probe(path, look.turn_deg)
    interval = 1.0 / (info.rate_hz or 30.0)
    reading = {"fps": look.fps, "interval_s": interval, "turn_deg": look.turn_deg}
    there = surveys.survey(path, network, look.span, _expected(info, look), **reading)
    chosen, begin = _chosen(path, there, look.choice)
    anchors = {one.row: one.pose for one in there.people[chosen]} if begin is not None else {}
    follower = Tracker(network, look.choice)
    passes, rows, behind = Passes(follower), _Rows(), Background()
    numbers: list[int] = []
    stamps, spent = list[float](), list[float]()
    clock = -interval
    began = time.perf_counter()
    for frame in frames.frames(path, look.span, **reading):  # type: ignore[arg-type]
        _check_size(path, frame.image, info.size_px)
        clock = frame.stamp_s if frame.stamp_s > clock else clock + interval * look.span.every
        here = anchors.get(frame.row)
        waits = begin is not None and frame.row < begin.row
        poses = passes.step(len(stamps), frame.image, clock, here, waits=waits)
        rows.set(poses)
        behind.step(frame.image, tuple(filter(None, (poses[len(stamps)], here))))
        numbers.append(frame.row)
        stamps.append(frame.stamp_s)
        spent.append(1000 * (time.perf_counter() - began))
        began += spent[-1] / 1000
        if progress is not None:
            progress(len(stamps), max(_expected(info, look), len(stamps)))
    rows.set(passes.finish())
    if len(stamps) < cutting.LEAST_FRAMES and not look.span.is_all:
        raise cutting.too_few(str(path), look.span, len(stamps), (0.0, (info.count - 1) * interval))
    if follower.chosen < 0:
        raise _nobody(path, follower, look.choice, len(stamps), _expected(info, look))
    values = rows.array().astype(float)
    points, scores, world = values[..., :2], np.nan_to_num(values[..., 2]), values[..., 3:6]
    times = _increasing(np.asarray(stamps), interval * look.span.every)
    scale = values[:, 0, 6] / BODY_M
    swapped = swaps.find(times, points, scores, world, scale)
    points, scores = swaps.exchange(points, swapped), swaps.exchange(scores, swapped)
    scores = np.where(jumps.find(times, points, scale), 0.0, scores)
    return Detection(
        np.asarray(stamps),
        np.asarray(numbers, np.int64),
        points,
        scores,
        swaps.exchange(world, swapped),
        swapped,
        np.asarray(spent),
        there.boxes(),
        np.asarray(there.rows, np.int64),
        chosen,
        follower.losses,
        passes.found_backward,
        np.array(behind.views).reshape(-1, 3, 3),
        np.array(behind.shares),
        info.size_px,
    )


def _chosen(path: Path, there: Survey, choice: Choice) -> tuple[int, Sighting | None]:
    """Index of the person to follow, and where they are seen first; none: the first one who comes."""
    if choice.at_px is not None:
        return there.at(*choice.at_px) or (-1, None)
    number = choice.number or 1
    if number > len(there.people) > 0:
        known = surveys.described(there.boxes(), len(there.rows))
        people = counted(len(there.people), "person", "people")
        raise InputError(f"{path}: --person {number}: found {people}: {known}")
    return (number - 1, there.people[number - 1][0]) if there.people else (-1, None)


def _expected(info: frames.Info, look: Look) -> int:
    """About how many frames there are to be looked at."""
    rate = look.fps or info.rate_hz or 30.0
    start_s = max(look.span.from_s or 0.0, 0.0)
    end_s = info.count / rate if look.span.to_s is None else min(look.span.to_s, info.count / rate)
    return max(round((end_s - start_s) * rate / look.span.every), 0)


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
    boxes = [[0, i, *figures.bounds(pose)] for i, pose in enumerate(follower.first)]
    if choice.at_px is not None and boxes:
        where = f"found no person at {choice.at_px[0]:g},{choice.at_px[1]:g}"
        there = surveys.described(np.array(boxes), 1)
        return InputError(
            f"{path}: --person-at: {where} in {counted(count, 'frame')}; valid: a place on one of {there}"
        )
    damaged = f", of {told}: the rest cannot be decoded" if count < told else ""
    nobody = f"found no person in {counted(count, 'frame')}{damaged}"
    return InputError(f"{path}: people: {nobody}; valid: a video that shows a person")
