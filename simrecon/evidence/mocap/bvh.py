"""BVH: a skeleton of offsets and channels, then the channels' values by frame.

A joint's position follows from its parents' channels: x = x_parent + G_parent (offset + t), G = G_parent R,
with R the product of the elementary rotations in the order in which the channels are listed.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from simrecon.evidence.axes import UNITS_M, find_unit, find_up, to_z_up
from simrecon.evidence.content import Content
from simrecon.evidence.mocap import names
from simrecon.evidence.options import Options
from simrecon.geometry import vectors
from simrecon.types import Array, Evidence

NEEDED = tuple(
    f"{side}_{joint}" for joint in ("hip", "knee", "ankle", "shoulder") for side in ("left", "right")
)
CHANNELS = tuple(f"{axis}{kind}" for kind in ("position", "rotation") for axis in "XYZ")
JOINTS_MAX, FRAMES_MAX = 10_000, 10_000_000


@dataclass
class Joint:
    """One joint of the hierarchy."""

    name: str
    parent: int
    offset: Array = field(default_factory=lambda: np.zeros(3))
    channels: tuple[str, ...] = ()


def matches(content: Content) -> bool:
    """Whether the file is BVH."""
    return content.kind == "text" and content.raw[:64].lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"HIERARCHY")


def read(content: Content, options: Options) -> Evidence:
    """Evidence of the skeleton's joints."""
    joints, interval_s, values = parse(content)
    places = positions(joints, values)
    at = names.joints([joint.name for joint in joints])
    if missing := [name for name in NEEDED if name not in at]:
        there = ", ".join(joint.name for joint in joints[:60])
        raise content.fail(
            "joints", f"none that is {', '.join(missing)} (there are {there})", "a human skeleton"
        )
    rest = positions(joints, np.zeros((1, values.shape[1])))[0]
    seen = points_evidence(
        content,
        options,
        {name: places[:, index] for name, index in at.items()},
        np.arange(len(places), dtype=np.float64) * (interval_s if options.fps is None else 1 / options.fps),
        rest=upright({name: rest[index] for name, index in at.items()}),
    )
    shin = (at["left_knee"], at["left_ankle"])
    ours = seen.joints_m[0, [seen.joint_names.index(name) for name in ("left_knee", "left_ankle")]]
    metre = float(np.linalg.norm(np.diff(ours, axis=0)) / np.linalg.norm(np.diff(places[0, shin], axis=0)))
    return replace(seen, lengths_m=_stated(joints, at, rest, metre))


def _stated(
    joints: list[Joint], at: dict[str, int], rest: Array, metre: float
) -> tuple[tuple[str, float], ...]:
    """What no pair of joints shows: the skull, and how far the ball of the foot is below the ankle at rest.

    Args:
        joints: of the hierarchy.
        at: which of them are ours, by name.
        rest: (K, 3) their places in the rest pose, file units.
        metre: of one unit of the file.
    """
    lengths: dict[str, float] = {}
    ends = [joint for joint in joints if joint.parent == at.get("skull_base") and not joint.name]
    if len(ends) == 1:
        lengths["skull"] = metre * float(np.linalg.norm(ends[0].offset))
    if {"left_mtp", "right_mtp"} <= set(at):
        up = vectors.unit(upright({name: rest[index] for name, index in at.items()}))
        down = [rest[at[f"{side}_ankle"]] - rest[at[f"{side}_mtp"]] for side in ("left", "right")]
        lengths["mtp_rest_drop"] = metre * float(np.mean(down, axis=0) @ up)
    return tuple((name, length) for name, length in lengths.items() if length > 0)


def points_evidence(
    content: Content,
    options: Options,
    points: dict[str, Array],
    times: Array,
    unit: str | None = None,
    notes: str = "",
    rest: Array | None = None,
) -> Evidence:
    """Evidence of points of a body in the file's own unit and axes.

    Args:
        content: the file.
        options: of the user.
        points: (T, 3) by name; NaN = unknown.
        times: (T,) s.
        unit: that the file states, or None.
        notes: on how the file was read.
        rest: (3,) from ankles to shoulders in the rest pose, where there is one.
    """
    unit_name, unit_how = find_unit(content.source, stature(points), options.unit, unit)
    axis, how = find_up(content.source, upright(points), options.up, rest)
    joints = np.stack(list(points.values()), axis=1) * UNITS_M[unit_name]  # (T, K, 3)
    reading = f"{len(points)} joints, unit {unit_name} ({unit_how}), up {axis} ({how})"
    return Evidence(
        times_s=times,
        keypoint_names=(),
        keypoints_px=np.empty((len(times), 0, 2)),
        scores=np.empty((len(times), 0)),
        joint_names=tuple(points),
        joints_m=joints @ to_z_up(axis).T,
        joints_frame="world",
        trust="mocap",
        camera=options.camera,
        sha256=content.sha256,
        reading="; ".join(part for part in (reading, notes) if part),
    )


def upright(points: dict[str, Array]) -> Array:
    """From the middle of the ankles to that of the shoulders, (T, 3)."""
    return _middle(points, "shoulder") - _middle(points, "ankle")


def _middle(points: dict[str, Array], joint: str) -> Array:
    middle: Array = (points[f"left_{joint}"] + points[f"right_{joint}"]) / 2
    return middle


def stature(points: dict[str, Array]) -> float:
    """Height of a person with these limbs: leg, trunk and an ankle's height and a head, which are 22 % of it.

    Ankle 3.9 % and head with neck 18.2 % of stature are Winter's (2009, fig. 4.1).
    """
    trunk = _middle(points, "shoulder") - _middle(points, "hip")
    total = float(np.nanmedian(np.linalg.norm(trunk, axis=-1)))
    for a, b in (("hip", "knee"), ("knee", "ankle")):
        lengths = [
            np.nanmedian(np.linalg.norm(points[f"{side}_{a}"] - points[f"{side}_{b}"], axis=-1))
            for side in ("left", "right")
        ]
        total += float(np.mean(lengths))
    return total / (1 - 0.039 - 0.182)


def parse(content: Content) -> tuple[list[Joint], float, Array]:
    """Joints, the frame interval in s, and the channels' values (T, C).

    Raises:
        InputError: damaged.
    """
    head, mark, tail = content.text.partition("MOTION")
    if not mark:
        raise content.fail("MOTION", "no such section", "a whole BVH file")
    joints = _hierarchy(content, head.split())
    width = sum(len(joint.channels) for joint in joints)
    words = tail.split(maxsplit=5)
    try:
        frames, interval = int(words[1]), float(words[4])
        named = words[0].lower() == "frames:" and [w.lower() for w in words[2:4]] == ["frame", "time:"]
    except (IndexError, ValueError):
        frames, interval, named = 0, 0.0, False
    if not named or not 0 < frames <= FRAMES_MAX or not 1e-4 < interval < 1:
        head = " ".join(tail.split(maxsplit=5)[:5])
        raise content.fail("MOTION", repr(head), "Frames: N, then Frame Time: seconds")
    numbers = words[5] if len(words) > 5 else ""
    try:
        values = np.array(numbers.split(), dtype=np.float64)
    except ValueError as error:
        raise content.fail("MOTION", str(error), "numbers") from error
    if len(values) != frames * width:
        there = f"{len(values)} values for {frames} frames of {width} channels"
        raise content.fail("MOTION", there, f"{frames * width} values: is the file whole?")
    if not np.isfinite(values).all():
        bad = int(np.argmax(~np.isfinite(values))) // max(width, 1)
        raise content.fail("MOTION", f"no number at frame {bad}", "finite numbers")
    return joints, interval, values.reshape(frames, width)


def _hierarchy(content: Content, words: list[str]) -> list[Joint]:
    joints: list[Joint] = []
    stack: list[int] = []
    i = 1
    try:
        while i < len(words):
            word = words[i].upper()
            if word in ("ROOT", "JOINT", "END"):
                start = i + 1
                while words[i] != "{":
                    i += 1
                if word == "ROOT" and joints:
                    raise content.fail("HIERARCHY", "a second ROOT", "a single skeleton")
                name = "" if word == "END" else " ".join(words[start:i])
                joints.append(Joint(name, stack[-1] if stack else -1))
                stack.append(len(joints) - 1)
                i += 1
            elif word == "OFFSET":
                joints[stack[-1]].offset = np.array([float(w) for w in words[i + 1 : i + 4]])
                i += 4
            elif word == "CHANNELS":
                count = int(words[i + 1])
                joints[stack[-1]].channels = _channels(content, words[i + 2 : i + 2 + count])
                i += 2 + count
            elif word == "}":
                stack.pop()
                i += 1
            else:
                raise content.fail("HIERARCHY", repr(words[i][:40]), "JOINT, OFFSET, CHANNELS, End Site or }")
            if len(joints) > JOINTS_MAX:
                raise content.fail("HIERARCHY", f"more than {JOINTS_MAX} joints", "a human skeleton")
    except (IndexError, ValueError) as error:
        raise content.fail("HIERARCHY", f"damage ({error})", "a whole BVH file") from error
    if stack or not joints or any(joint.offset.shape != (3,) for joint in joints):
        raise content.fail("HIERARCHY", "an unfinished joint", "a whole BVH file")
    return joints


def _channels(content: Content, names: list[str]) -> tuple[str, ...]:
    known = {name.lower(): name for name in CHANNELS}
    if unknown := [name for name in names if name.lower() not in known]:
        raise content.fail("CHANNELS", ", ".join(unknown), ", ".join(CHANNELS))
    return tuple(known[name.lower()] for name in names)


def positions(joints: list[Joint], values: Array) -> Array:
    """Positions (T, K, 3) of all joints, end sites included, in the file's unit and axes."""
    frames = len(values)
    places = np.empty((frames, len(joints), 3))
    turned: list[Array] = []
    column = 0
    for i, joint in enumerate(joints):
        moved = np.broadcast_to(joint.offset, (frames, 3)).copy()
        rotation = np.broadcast_to(np.eye(3), (frames, 3, 3))
        positions = [name for name in joint.channels if name.endswith("position")]
        if positions and joint.parent < 0:
            moved[:] = joint.offset if len(positions) < 3 else 0.0
        for name in joint.channels:
            value = values[:, column]
            column += 1
            axis = "XYZ".index(name[0])
            if name.endswith("position"):
                moved[:, axis] = value if joint.parent < 0 else joint.offset[axis] + value
            else:
                rotation = rotation @ _elementary(axis, np.radians(value))
        if joint.parent < 0:
            places[:, i] = moved
            turned.append(rotation)
        else:
            before = turned[joint.parent]
            places[:, i] = places[:, joint.parent] + (before @ moved[..., None])[..., 0]
            turned.append(before @ rotation)
    return places


def _elementary(axis: int, angle: Array) -> Array:
    """Rotations (T, 3, 3) by angles (T,) about one axis."""
    a, b = (axis + 1) % 3, (axis + 2) % 3
    rotation = np.zeros((len(angle), 3, 3))
    rotation[:, axis, axis] = 1.0
    rotation[:, a, a] = rotation[:, b, b] = np.cos(angle)
    rotation[:, b, a] = np.sin(angle)
    rotation[:, a, b] = -rotation[:, b, a]
    return rotation
