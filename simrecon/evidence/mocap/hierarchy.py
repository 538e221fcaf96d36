"""The text of a BVH file: a hierarchy of offsets and channels, then the channels' values by frame.

A joint's position follows from its parents' channels: x = x_parent + G_parent (offset + t), G = G_parent R,
with R the product of the elementary rotations in the order in which the channels are listed. Where a file has
position channels for joints below the root, t stands for the whole translation in most of them (`added`).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from simrecon.evidence.content import Content
from simrecon.evidence.values import bounded
from simrecon.io.messages import counted
from simrecon.types import Array

BoolArray = NDArray[np.bool_]

CHANNELS = tuple(f"{axis}{kind}" for kind in ("position", "rotation") for axis in "XYZ")
JOINTS_MAX, FRAMES_MAX = 10_000, 10_000_000
CLEAR = 0.8
"""Positions that much nearer to the offset than to zero, of 1, or the reverse, decide for their joint."""


@dataclass
class Joint:
    """One joint of the hierarchy; an end site has no name."""

    name: str
    parent: int
    offset: Array = field(default_factory=lambda: np.zeros(3))
    channels: tuple[str, ...] = ()


def parse(content: Content) -> tuple[list[Joint], float, Array]:
    """Joints, the frame interval in s as it stands there, and the channels' values (T, C).

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
    if not named or not 0 < frames <= FRAMES_MAX:
        head = " ".join(tail.split(maxsplit=5)[:5])
        raise content.fail("MOTION", repr(head), "Frames: N, then Frame Time: seconds")
    numbers = words[5] if len(words) > 5 else ""
    try:
        values = np.array(numbers.split(), dtype=np.float64)
    except ValueError as error:
        found = str(error).removeprefix("could not convert string to float: ")
        raise content.fail("MOTION", found, "numbers with a point") from error
    if len(values) != frames * width:
        there = (
            f"{counted(len(values), 'value')} for {counted(frames, 'frame')} of {counted(width, 'channel')}"
        )
        raise content.fail("MOTION", there, f"{frames * width} values: is the file whole?")
    if not np.isfinite(values).all():
        bad = int(np.argmax(~np.isfinite(values))) // max(width, 1)
        raise content.fail("MOTION", f"no number at frame {bad}", "finite numbers")
    bounded(content, "MOTION", values)
    if np.isnan(bounded(content, "OFFSET", np.array([joint.offset for joint in joints]))).any():
        raise content.fail("OFFSET", "no number", "finite numbers")
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


def positions(joints: list[Joint], values: Array, on_top: BoolArray | None = None) -> Array:
    """Positions (T, K, 3) of all joints, end sites included, in the file's unit and axes.

    Args:
        joints: of the hierarchy.
        values: (T, C) of the channels.
        on_top: (K,) joints whose position channels are added to the offset instead of standing for it.
    """
    frames = len(values)
    places = np.empty((frames, len(joints), 3))
    turned: list[Array] = []
    column = 0
    for i, joint in enumerate(joints):
        root = joint.parent < 0
        moved = np.broadcast_to(joint.offset, (frames, 3)).copy()
        rotation = np.broadcast_to(np.eye(3), (frames, 3, 3))
        for name in joint.channels:
            value = values[:, column]
            column += 1
            axis = "XYZ".index(name[0])
            if name.endswith("position"):
                moved[:, axis] = value + (joint.offset[axis] if on_top is not None and on_top[i] else 0.0)
            else:
                rotation = rotation @ _elementary(axis, np.radians(value))
        if root:
            places[:, i] = moved
            turned.append(rotation)
        else:
            before = turned[joint.parent]
            places[:, i] = places[:, joint.parent] + (before @ moved[..., None])[..., 0]
            turned.append(before @ rotation)
    return places


def rest(joints: list[Joint]) -> Array:
    """Positions (K, 3) of all joints where nothing turns and every joint is at its offset."""
    places = np.zeros((len(joints), 3))
    for i, joint in enumerate(joints):
        places[i] = joint.offset + (places[joint.parent] if joint.parent >= 0 else 0.0)
    return places


def added(joints: list[Joint], values: Array) -> BoolArray | None:
    """Joints (K,) whose position channels come on top of OFFSET; None where only the root has any.

    Blender, Maya and MotionBuilder write six channels for every joint, whose positions are the whole
    translation: near OFFSET, or elsewhere if OFFSET was scaled or left out. Where positions are about zero
    while OFFSET isn't, they say how far the joint is from there. A joint that is near neither does as the
    others do, each of which counts by how much nearer to one it is; a tie is the former.
    """
    votes = np.full(len(joints), np.nan)  # from -1, added, to 1
    column = 0
    for row, joint in enumerate(joints):
        axes = ["XYZ".index(name[0]) for name in joint.channels if name.endswith("position")]
        columns = [column + i for i, name in enumerate(joint.channels) if name.endswith("position")]
        column += len(joint.channels)
        if joint.parent < 0 or not axes:
            continue
        offset, typical = joint.offset[axes], np.median(values[:, columns], axis=0)
        size = float(np.linalg.norm(offset))
        nearer = float(np.linalg.norm(typical) - np.linalg.norm(typical - offset))
        votes[row] = nearer / size if size > 0 else 0.0
    if np.isnan(votes).all():
        return None
    clear = np.abs(votes) > CLEAR
    on_top: BoolArray = np.where(clear, votes < 0, np.nansum(votes) < 0) & np.isfinite(votes)
    return on_top


def _elementary(axis: int, angle: Array) -> Array:
    """Rotations (T, 3, 3) by angles (T,) about one axis."""
    a, b = (axis + 1) % 3, (axis + 2) % 3
    rotation = np.zeros((len(angle), 3, 3))
    rotation[:, axis, axis] = 1.0
    rotation[:, a, a] = rotation[:, b, b] = np.cos(angle)
    rotation[:, b, a] = np.sin(angle)
    rotation[:, a, b] = -rotation[:, b, a]
    return rotation
