"""SAM 3D Body: people by frame with landmarks in the image and joints in space.

By person `pred_keypoints_3d` and `pred_keypoints_2d` in the order of MHR's first 70 keypoints, `pred_cam_t`,
`focal_length`; a list of frames, each a list of people.
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
from simrecon.evidence.values import as_array
from simrecon.types import Evidence


def matches(content: Content) -> bool:
    """Whether the file is SAM 3D Body's."""
    return any("pred_keypoints_3d" in person for _, person in _people(content.tree, first=True))


def read(content: Content, options: Options) -> Evidence:
    """Evidence of one person of SAM 3D Body's outputs."""
    detections: list[Detection] = []
    people: list[Person] = []
    names = layouts.layout("mhr_70")
    for where, person in _people(content.tree, first=False):
        number, label = where
        joints = people3d.array(
            content, f"{label}.pred_keypoints_3d", person.get("pred_keypoints_3d"), (len(names), 3)
        )
        points = people3d.array(
            content, f"{label}.pred_keypoints_2d", person.get("pred_keypoints_2d"), (len(names), 2)
        )
        place = people3d.array(content, f"{label}.pred_cam_t", person.get("pred_cam_t"), (3,))
        focal = people3d.array(content, f"{label}.focal_length", person.get("focal_length"), None).reshape(-1)
        if not len(focal) or not (focal > 0).all():
            raise content.fail(f"{label}.focal_length", f"{min(focal, default=0.0):g}", "above 0 px")
        who = person.get("track_id", person.get("person_id"))
        detections.append(
            tracks.detection(
                number, points, np.ones(len(names)), None if who is None else str(who), len(people)
            )
        )
        people.append(Person(joints, place, float(focal.mean())))
    return people3d.to_evidence(content, options, detections, people, names, None)


def _people(tree: Any, *, first: bool) -> list[tuple[tuple[int, str], Mapping[str, Any]]]:
    """People with frame number and a label for messages; only those of the first frame, for a look at it."""
    if isinstance(tree, np.ndarray) and _is_list(tree):
        tree = list(tree)
    if isinstance(tree, Mapping) and "pred_keypoints_3d" in tree:
        return _stacked(tree)
    if isinstance(tree, Mapping):
        frames = [
            (entries.number(str(key), i), str(key), value) for i, (key, value) in enumerate(tree.items())
        ]
    elif isinstance(tree, list):
        frames = [(i, f"[{i}]", value) for i, value in enumerate(tree)]
    else:
        return []
    people = []
    for number, label, frame in frames[:8] if first else frames:
        if isinstance(frame, Mapping) and "pred_keypoints_3d" not in frame:
            frame = frame.get("outputs", frame.get("people", frame))
        listed = [frame] if isinstance(frame, Mapping) else list(frame) if _is_list(frame) else []
        people += [
            ((number, f"{label}[{k}]"), person)
            for k, person in enumerate(listed)
            if isinstance(person, Mapping)
        ]
    return people


def _is_list(frame: Any) -> bool:
    if isinstance(frame, np.ndarray):
        return bool(frame.dtype.hasobject and frame.ndim)
    return isinstance(frame, (list, tuple))


def _stacked(tree: Mapping[str, Any]) -> list[tuple[tuple[int, str], Mapping[str, Any]]]:
    """One person with all frames in one array."""
    joints = as_array(tree["pred_keypoints_3d"])
    if joints is None or joints.ndim != 3:
        return [((0, "people[0]"), tree)]
    rows = {key: array for key, value in tree.items() if (array := as_array(value)) is not None}
    per_frame = {key: array for key, array in rows.items() if array.ndim and len(array) == len(joints)}
    shared = {key: array for key, array in rows.items() if key not in per_frame}
    return [
        ((i, f"[{i}]"), shared | {key: array[i] for key, array in per_frame.items()} | {"track_id": 0})
        for i in range(len(joints))
    ]
