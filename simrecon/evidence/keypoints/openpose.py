"""OpenPose: a folder of JSON files, one a frame, with `people[].pose_keypoints_2d` (x, y, confidence)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from simrecon.evidence.content import Content, json_or_none, open_content
from simrecon.evidence.keypoints import entries, layouts, tracks
from simrecon.evidence.keypoints.following import Detection
from simrecon.evidence.options import Options
from simrecon.io.messages import counted
from simrecon.types import Evidence

ORDER = layouts.Order(
    "pose_keypoints_2d", ("openpose_25", "openpose_25b", "openpose_18", "openpose_15", "vitpose_25")
)


def matches(content: Content) -> bool:
    """A folder of OpenPose's files, or one of them."""
    if content.kind == "folder":
        return bool(content.json_files) and _is_frame(_parsed(content, 0))
    return content.kind == "json" and _is_frame(content.tree)


def read(content: Content, options: Options) -> Evidence:
    """Evidence of a folder of OpenPose's files."""
    if content.kind != "folder":
        raise content.fail("people", "a single frame", "the folder with the files of all frames")
    detections: list[Detection] = []
    count = empty = 0
    numbers, note = entries.numbers([path.name for path in content.json_files])
    for frame, path in zip(numbers, content.json_files, strict=True):
        one = open_content(path)
        if not _is_frame(one.tree):
            raise one.fail("people", "no such list", "OpenPose's file of a frame")
        for k, person in enumerate(one.tree["people"]):
            if entries.lacks(person, "pose_keypoints_2d"):
                empty += 1
                continue
            values = entries.triples(
                one, f"people[{k}].pose_keypoints_2d", entries.get(person, "pose_keypoints_2d"), count
            )
            count = len(values)
            ids = person.get("person_id")
            who = str(ids[0]) if isinstance(ids, list) and ids and ids[0] not in (-1, None) else None
            detections.append(tracks.detection(frame, values[:, :2], values[:, 2], who))
    left_out = f"{empty} empty people left out" if empty else ""
    notes = [counted(len(content.json_files), "file"), note, left_out]
    text = "; ".join(part for part in notes if part)
    return tracks.to_evidence(content, detections, ORDER, options, text, centred=True)


def _is_frame(tree: Any) -> bool:
    return isinstance(tree, Mapping) and isinstance(tree.get("people"), list)


def _parsed(content: Content, index: int) -> Any:
    return json_or_none(content.json_files[index])
