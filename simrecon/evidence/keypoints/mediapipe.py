"""MediaPipe Pose as JSON: BlazePose's 33 landmarks by frame, in the image and in metres around the hips.

There is no format of its own: everybody writes the result object of a frame, or lists of it, as their
language spells it. Read are `pose_landmarks` and `pose_world_landmarks` (Python, also camelCase), `landmarks`
and `worldLandmarks` (JavaScript); one person's landmarks, a list of people (Tasks API), or `landmark` within
(Solutions); each landmark a dictionary of x, y, z, visibility, presence, or a list of them in that order;
frames in a list, by number, or under a key such as `frames`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from simrecon.evidence.content import Content
from simrecon.evidence.keypoints import following, layouts, mediapipe_frames, solid, tracks
from simrecon.evidence.keypoints.following import Detection
from simrecon.evidence.options import Options
from simrecon.evidence.values import bounded
from simrecon.io.messages import counted
from simrecon.types import Array, Evidence

NAMES = layouts.layout("blazepose_33")
COUNT = len(NAMES)


def matches(content: Content) -> bool:
    """MediaPipe's landmarks of a pose."""
    return content.kind == "json" and mediapipe_frames.is_there(content.tree)


def read(content: Content, options: Options) -> Evidence:
    """Evidence of MediaPipe's landmarks."""
    frames = mediapipe_frames.listed(content)
    in_image = any(frame.image for frame in frames)
    detections: list[Detection] = []
    worlds: list[Array] = []
    for frame in frames:
        seen = [_landmarks(content, frame.key, one) for one in frame.image]
        space = [_landmarks(content, frame.key, one) for one in frame.world]
        if seen and space and len(seen) != len(space):
            text = f"{counted(len(seen), 'person', 'people')} in the image and {len(space)} in space"
            raise content.fail(frame.key, text, "as many")
        for k, values in enumerate(seen if in_image else space):
            detections.append(
                tracks.detection(frame.number, values[:, :2], _scores(values), None, len(worlds))
            )
            worlds.append(space[k][:, :3] if space else np.full((COUNT, 3), np.nan))
    stamps = mediapipe_frames.stamps_s(frames)
    note = "times as in the file" if stamps is not None and options.fps is None else ""
    if not in_image:
        return _in_space(content, detections, worlds, options, stamps, note)
    track, how = tracks.followed(content, detections, options)
    notes = "; ".join(part for part in (note, how) if part)
    evidence = tracks.of_track(content, track, NAMES, options, notes, stamps_s=stamps)
    joints = np.stack([worlds[one.index] for one in track])
    if not np.isfinite(joints).any():
        return evidence
    return replace(
        evidence,
        joint_names=NAMES,
        joints_m=joints,
        joints_frame="camera_root_relative",
        reading=f"{evidence.reading}; world landmarks as the 3D estimate",
    )


def _in_space(
    content: Content,
    detections: Sequence[Detection],
    worlds: Sequence[Array],
    options: Options,
    stamps_s: Mapping[int, float] | None,
    notes: str,
) -> Evidence:
    """Evidence of world landmarks alone."""
    track, how = following.follow(content, detections, options.person)
    joints = np.stack([worlds[one.index] for one in track])
    frames = np.array([one.frame for one in track])
    notes = "; ".join(part for part in (notes, how) if part)
    return solid.to_evidence(content, frames, joints, NAMES, options, notes, stamps_s=stamps_s)


def _landmarks(content: Content, key: str, person: Any) -> Array:
    """x, y, z, visibility, presence (33, 5) of a person."""
    rows = mediapipe_frames.values(person)
    if rows is None or len(rows) != COUNT:
        text = f"{counted(len(person), 'landmark')}" if rows is not None else "landmarks that are no numbers"
        raise content.fail(key, text, f"{COUNT} of x, y, z, with visibility and presence where known")
    return bounded(content, key, np.array(rows))


def _scores(values: Array) -> Array:
    """Visibility times presence, 1 where there is none."""
    return np.asarray(np.clip(values[:, 3], 0.0, 1.0) * np.clip(values[:, 4], 0.0, 1.0))
