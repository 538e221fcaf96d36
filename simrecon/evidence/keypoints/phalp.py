"""PHALP and 4DHumans: people by frame with landmarks in the image and joints in space.

By frame `tid`, `3d_joints` (the first 25 in OpenPose's order), `2d_joints` as shares of the longer side of
the image, padded to a square, `size`, `tracked_time` (0 where the person was seen). Its camera is nearly
orthographic and its distance no distance: the joints are taken as a shape around the hips.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from simrecon.evidence.content import Content
from simrecon.evidence.keypoints import entries, layouts, people3d, tracks
from simrecon.evidence.keypoints.following import Detection
from simrecon.evidence.keypoints.people3d import Person
from simrecon.evidence.options import Options
from simrecon.io.messages import counted
from simrecon.types import Evidence

OPENPOSE = 25


def matches(content: Content) -> bool:
    """Whether the file is PHALP's."""
    tree = content.tree
    first = next(iter(tree.values()), None) if isinstance(tree, Mapping) else None
    return isinstance(first, Mapping) and "3d_joints" in first and "tid" in first


def read(content: Content, options: Options) -> Evidence:
    """Evidence of one person of a PHALP file."""
    detections: list[Detection] = []
    people: list[Person] = []
    sizes: set[tuple[int, int]] = set()
    for i, (name, frame) in enumerate(content.tree.items()):
        number = entries.whole(content, f"{name}.time", _time(frame, i))
        for k, who in enumerate(_row(content, name, frame, "tid")):
            late = _row(content, name, frame, "tracked_time") if "tracked_time" in frame else []
            if len(late) > k and entries.whole(content, f"{name}.tracked_time[{k}]", late[k]) > 0:
                continue  # not seen in this frame; the values are those of an earlier one
            key = f"{name}.3d_joints[{k}]"
            joints = people3d.array(content, key, _at(content, name, frame, "3d_joints", k), (None, 3))
            size = people3d.array(content, f"{name}.size[{k}]", _at(content, name, frame, "size", k), (2,))
            height, width = (int(n) for n in size)
            sizes.add((width, height))
            flat = people3d.array(
                content, f"{name}.2d_joints[{k}]", _at(content, name, frame, "2d_joints", k), None
            )
            points = flat.reshape(-1, 2)[: len(joints)] * max(width, height)
            points -= [(max(width, height) - width) / 2, (max(width, height) - height) / 2]
            if len(points) < OPENPOSE or len(joints) < OPENPOSE:
                raise content.fail(key, f"{counted(len(joints), 'joint')}", f"{OPENPOSE} or more")
            place = people3d.array(
                content, f"{name}.camera[{k}]", _at(content, name, frame, "camera", k), (3,)
            )
            detections.append(
                tracks.detection(number, points[:OPENPOSE], np.ones(OPENPOSE), str(who), len(people))
            )
            people.append(Person(joints[:OPENPOSE], place, np.nan))
    if len(sizes) > 1:
        raise content.fail("size", f"{len(sizes)} sizes of images", "one")
    names = layouts.layout("openpose_25")
    return people3d.to_evidence(content, options, detections, people, names, next(iter(sizes), None))


def _time(frame: Any, fallback: int) -> Any:
    return frame.get("time", fallback) if isinstance(frame, Mapping) else fallback


def _row(content: Content, name: Any, frame: Any, key: str) -> list[Any]:
    row = frame.get(key) if isinstance(frame, Mapping) else None
    if not isinstance(row, (list, tuple, np.ndarray)):
        raise content.fail(f"{name}.{key}", "no such list", "a list of people")
    return list(row)


def _at(content: Content, name: Any, frame: Any, key: str, index: int) -> Any:
    row = _row(content, name, frame, key)
    if index >= len(row):
        raise content.fail(
            f"{name}.{key}", counted(len(row), "person", "people"), f"{index + 1} or more, as in tid"
        )
    return row[index]
