"""The frames of MediaPipe's results, however they were put into JSON (see `mediapipe`)."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from simrecon.evidence.content import Content
from simrecon.evidence.keypoints import entries

COUNT = 33
IMAGE = ("poselandmarks", "landmarks", "normalizedlandmarks", "imagelandmarks", "keypoints")
WORLD = ("poseworldlandmarks", "worldlandmarks", "keypoints3d")
LISTS = ("frames", "results", "data", "poses", "detections", "landmarkframes")
NUMBERS = ("frame", "frameindex", "frameid", "framenumber", "frameidx", "index")
STAMPS = {
    "timestampms": 1e-3, "timestampinms": 1e-3, "timems": 1e-3, "timestampus": 1e-6, "timestamps": 1.0,
    "timestampseconds": 1.0, "timesec": 1.0, "times": 1.0, "timeseconds": 1.0,
}  # fmt: skip
"""Keys of a frame's time without separators, and their unit in seconds. That of `timestamp` is not known."""


@dataclass(frozen=True)
class Frame:
    """What was found in one frame.

    Attributes:
        number: of it; stamp_s: its time, None if the file has none.
        key: its place, for messages.
        image, world: people's landmarks, as they stand in the file.
    """

    number: int
    stamp_s: float | None
    key: str
    image: list[Any]
    world: list[Any]


def is_there(tree: Any) -> bool:
    """Whether a tree has a frame with BlazePose's number of landmarks among the first ones."""
    frames = _entries(tree)
    return frames is not None and any(
        len(person) == COUNT
        for _, frame in frames[:300]
        for person in (*_people(_value(frame, IMAGE)), *_people(_value(frame, WORLD)))
    )


def listed(content: Content) -> list[Frame]:
    """The frames of a file, in order."""
    found = _entries(content.tree) or []
    stated = [_number(frame, NUMBERS) for _, frame in found]
    named = [entries.number(key, -1) if key else -1 for key, _ in found]
    order = list(range(len(found)))
    numbers = next(
        (list(one) for one in (stated, named) if -1 not in one and len(set(one)) == len(one)), order
    )
    return [
        Frame(
            number,
            _stamp(frame),
            f"frame {number}",
            _people(_value(frame, IMAGE)),
            _people(_value(frame, WORLD)),
        )
        for number, (_, frame) in zip(numbers, found, strict=True)
    ]


def stamps_s(frames: Sequence[Frame]) -> dict[int, float] | None:
    """Times of frames by number, if all have one and they increase."""
    times = [frame.stamp_s for frame in frames if frame.image or frame.world]
    known = [time for time in times if time is not None]
    if not known or len(known) < len(times) or any(b <= a for a, b in pairwise(known)):
        return None
    return {frame.number: frame.stamp_s for frame in frames if frame.stamp_s is not None}


def values(person: Any) -> list[list[float]] | None:
    """x, y, z, visibility, presence of each landmark of a person; None if there is something else."""
    rows = []
    for one in person:
        if isinstance(one, Mapping):
            row = [one.get("x"), one.get("y"), one.get("z", 0.0)]
            row += [_score(one, ("visibility", "score")), _score(one, ("presence",))]
        else:
            row = [*one[:3], *[0.0] * (3 - len(one)), *one[3:5]]
            row += [1.0] * (5 - len(row))
        if not all(isinstance(x, (int, float)) and not isinstance(x, bool) for x in row):
            return None
        rows.append([float(x) for x in row])
    return rows


def _score(one: Mapping[str, Any], keys: Sequence[str]) -> Any:
    return next((one[key] for key in keys if one.get(key) is not None), 1.0)


def _flat(key: Any) -> str:
    return re.sub(r"[^a-z0-9]", "", str(key).lower())


def _value(frame: Any, keys: Sequence[str]) -> Any:
    """The value of the first of some keys in a frame; a bare list is that of landmarks in the image."""
    if isinstance(frame, Mapping):
        flat = {_flat(key): value for key, value in frame.items()}
        return next((flat[key] for key in keys if key in flat), None)
    return frame if keys is IMAGE else None


def _entries(tree: Any) -> list[tuple[str, Any]] | None:
    """Name or `""`, and content of each frame; None if the tree has no frames."""
    if isinstance(tree, list):
        return [("", one) for one in tree]
    if not isinstance(tree, Mapping):
        return None
    keys = {_flat(key): key for key in tree}
    for name in LISTS:
        if name in keys and isinstance(tree[keys[name]], (list, Mapping)):
            return _entries(tree[keys[name]])
    own = [keys[key] for key in (*IMAGE, *WORLD) if key in keys and isinstance(tree[keys[key]], list)]
    if own:  # lists over the frames
        count = max(len(tree[key]) for key in own)
        return [("", {key: tree[key][i] for key in own if i < len(tree[key])}) for i in range(count)]
    if tree and all(re.search(r"\d", str(key)) for key in tree):
        return [(str(key), value) for key, value in tree.items()]
    return None


def _people(value: Any) -> list[Any]:
    """People, each a list of landmarks: of one person's, of a list of people, or of what wraps them."""
    if isinstance(value, Mapping):
        inner = value.get("landmark", value.get("landmarks"))
        return _people(inner) if inner is not None else []
    if not isinstance(value, list) or not value:
        return []
    if all(_is_landmark(one) for one in value):
        return [value]
    people = [_people(one) for one in value]
    return [one[0] for one in people if len(one) == 1]


def _is_landmark(one: Any) -> bool:
    if isinstance(one, Mapping):
        return "x" in one and "y" in one
    return isinstance(one, list) and 2 <= len(one) <= 5 and all(isinstance(x, (int, float)) for x in one)


def _number(frame: Any, keys: Sequence[str]) -> int:
    value = _value(frame, keys) if isinstance(frame, Mapping) else None
    return int(value) if isinstance(value, (int, float)) and value == int(value) else -1


def _stamp(frame: Any) -> float | None:
    if not isinstance(frame, Mapping):
        return None
    for key, value in frame.items():
        if _flat(key) in STAMPS and isinstance(value, (int, float)) and not isinstance(value, bool):
            return float(value) * STAMPS[_flat(key)]
    return None
