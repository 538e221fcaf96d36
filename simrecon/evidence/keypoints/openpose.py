"""OpenPose: a folder of JSON files, one a frame, with `people[].pose_keypoints_2d` (x, y, confidence)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from simrecon.evidence.content import Content, open_content
from simrecon.evidence.keypoints import entries, layouts, tracks
from simrecon.evidence.keypoints.tracks import Detection
from simrecon.evidence.options import Options
from simrecon.types import Evidence

LAYOUTS = ("openpose_25", "openpose_18")


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
    count = 0
    for i, path in enumerate(content.json_files):
        one = open_content(path)
        if not _is_frame(one.tree):
            raise one.fail("people", "no such list", "OpenPose's file of a frame")
        frame = entries.number(path.name.removesuffix("_keypoints.json"), i)
        for k, person in enumerate(one.tree["people"]):
            values = entries.triples(
                one, f"people[{k}].pose_keypoints_2d", entries.get(person, "pose_keypoints_2d"), count
            )
            count = len(values)
            ids = person.get("person_id")
            who = str(ids[0]) if isinstance(ids, list) and ids and ids[0] not in (-1, None) else None
            detections.append(tracks.detection(frame, values[:, :2], values[:, 2], who))
    names = layouts.by_count(content, "pose_keypoints_2d", count, LAYOUTS) if detections else ()
    return tracks.to_evidence(content, detections, names, options, f"{len(content.json_files)} files")


def _is_frame(tree: Any) -> bool:
    return isinstance(tree, Mapping) and isinstance(tree.get("people"), list)


def _parsed(content: Content, index: int) -> Any:
    try:
        return json.loads(content.json_files[index].read_bytes()[: 1 << 24])
    except (OSError, ValueError, RecursionError):
        return None
