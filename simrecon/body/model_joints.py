"""Joints of a body model's file: their names, and the segments of ours that they move."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from simrecon.body.skeleton import template
from simrecon.errors import InputError
from simrecon.types import IntArray

# Joints in the order of the SMPL family; those that follow belong to hands, jaw and eyes.
_SMPL = (
    "pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle",
    "right_ankle", "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar", "head",
    "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist",
)  # fmt: skip
_COUNTS = {24: "SMPL", 52: "SMPL-H", 55: "SMPL-X"}
# Other names of our segments, in lower case without "_", " " and "-"; the first that a file has counts.
_ALIASES = {
    "pelvis": ("pelvis", "hips", "root"),
    "spine": ("spine1", "spine", "spinelower"),
    "chest": ("spine2", "chest", "spinemiddle"),
    "neck": ("neck", "neck1"),
    "head": ("head",),
    "hip": ("hip", "upleg", "upperleg", "thigh"),
    "knee": ("knee", "leg", "lowerleg", "calf"),
    "ankle": ("ankle", "foot"),
    "shoulder": ("upperarm", "arm", "shoulder"),
    "elbow": ("elbow", "forearm", "lowerarm"),
    "wrist": ("wrist", "hand"),
}


def names(data: dict[str, Any], joints: int, path: Path | str) -> tuple[str, ...]:
    """Names (K,) of the joints: those of the file, or of the SMPL family by their number.

    Raises:
        InputError: the file names none, and their number is not known either.
    """
    listed = data.get("joint_names")
    if listed is not None and len(listed) == joints:
        return tuple(str(name) for name in listed)
    if joints not in _COUNTS:
        known = ", ".join(f"{count} ({name})" for count, name in _COUNTS.items())
        raise InputError(f"{path}: joint_names: none for {joints} joints; without names valid: {known}")
    return _SMPL + tuple(f"further{i}" for i in range(joints - len(_SMPL)))


def segments(names: tuple[str, ...], parents: IntArray, path: Path | str) -> tuple[list[int], dict[str, int]]:
    """Which segment of ours each joint of the file moves.

    Args:
        names: (K,) of the file's joints.
        parents: (K,) of the file's joints.
        path: named in errors.

    Returns:
        Segment of each joint (K,), that of its nearest ancestor if it is none of ours; and the joint of each
        segment by the segment's name.

    Raises:
        InputError: a segment has no joint.
    """
    joints: dict[str, int] = {}
    plain = [name.lower().replace("_", "").replace(" ", "").replace("-", "") for name in names]
    for segment in template().names:
        side, _, stem = segment.rpartition("_")
        aliases = [
            name
            for alias in _ALIASES[stem]
            for name in dict.fromkeys((side + alias, alias + side, side[:1] + alias))
        ]
        hits = [name for name in aliases if name in plain]
        if not hits:
            raise InputError(f"{path}: joint_names: none of them is {segment!r}; valid: {', '.join(aliases)}")
        joints[segment] = plain.index(hits[0])
    ours = {joint: template().names.index(segment) for segment, joint in joints.items()}
    owner = [0] * len(names)
    for i, parent in enumerate(parents):
        owner[i] = ours.get(i, owner[parent] if parent >= 0 else 0)
    return owner, joints
