"""MMPose, RTMPose: frames of `instances[{keypoints, keypoint_scores}]`, in the image or in space.

- `instance_info[{frame_id, instances}]` with `meta_info`, as the demos save it;
- that list alone, as `MMPoseInferencer` saves it of a video; or a list of lists of instances;
- a folder with one list of instances by image, as it saves them of a folder of images.

A lifter (`Pose3DInferencer`) writes three coordinates: x to the left, y ahead, z up from the lowest point of
each frame. That is a mirror image (x would have to go to the right), which `solid` sees by the knees.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from simrecon.evidence.content import Content, json_or_none, open_content
from simrecon.evidence.keypoints import anatomy, entries, following, layouts, pixels, solid, tracks
from simrecon.evidence.keypoints.following import Detection
from simrecon.evidence.options import Options
from simrecon.io.messages import counted
from simrecon.types import Array, Evidence

ORDER = layouts.Order(
    "instance_info",
    (
        "coco_17", "h36m_17", "halpe_26", "wholebody_133", "halpe_136", "mpii_16", "aic_14", "crowdpose_14",
        "vitpose_25", "openpose_25", "openpose_25b",
    ),
)  # fmt: skip


def matches(content: Content) -> bool:
    """MMPose's predictions."""
    if content.kind == "folder":
        return bool(content.json_files) and _is_people(_parsed(content))
    tree = content.tree if content.kind == "json" else None
    if isinstance(tree, Mapping):
        return "instance_info" in tree or isinstance(tree.get("predictions"), list)
    some = tree[:32] if isinstance(tree, list) else []
    return any(_is_frame(one) or _is_people(one) for one in some)


def read(content: Content, options: Options) -> Evidence:
    """Evidence of MMPose's predictions."""
    detections: list[Detection] = []
    depths: list[Array] = []
    count = empty = 0
    listed, note = _numbered(content)
    for number, key, instances in listed:
        for k, one in enumerate(instances):
            where = f"{key}[{k}]"
            if entries.lacks(one, "keypoints"):
                empty += 1
                continue
            points, scores = _landmarks(content, where, one, count)
            count = len(points)
            who = one.get("track_id", one.get("instance_id"))
            who = None if who is None or isinstance(who, list) else str(who)
            detections.append(tracks.detection(number, points[:, :2], scores, who, len(depths)))
            depths.append(points[:, 2] if points.shape[1] == 3 else np.full(len(points), np.nan))
    names = _meta(content, count) if detections else ()
    text = "; ".join(part for part in (note, f"{empty} empty people left out" if empty else "") if part)
    if _has_depth(detections, depths):
        return _in_space(content, detections, depths, names, options, text)
    return tracks.to_evidence(content, detections, names, options, text)


def _numbered(content: Content) -> tuple[list[tuple[int, str, list[Any]]], str]:
    """Number, key for messages and instances of each frame, and a word on the numbers."""
    frames = list(_frames(content))
    if content.kind == "folder":
        numbers, note = entries.numbers([path.name for path in content.json_files])
    else:
        stated = [number for number, _, _ in frames]
        numbers = [i if number is None else number for i, number in enumerate(stated)]
        note = ""
        if len(set(numbers)) < len(numbers):
            numbers, note = list(range(len(frames))), "frames that share a number are counted in their order"
    return [(number, key, one) for number, (_, key, one) in zip(numbers, frames, strict=True)], note


def _frames(content: Content) -> Iterator[tuple[int | None, str, list[Any]]]:
    """Stated number or None, key for messages, and instances of each frame."""
    if content.kind == "folder":
        for path in content.json_files:
            one = open_content(path)
            if not _is_people(one.tree):
                raise one.fail("instances", "no such list", "MMPose's list of people in an image")
            yield None, f"{path.name}: instances", one.tree
        return
    tree, name = content.tree, ""
    if isinstance(tree, Mapping):
        name = "instance_info" if "instance_info" in tree else "predictions"
        tree = tree[name]
    if not isinstance(tree, list):
        raise content.fail(name, f"a {type(tree).__name__}", "a list of frames")
    for i, frame in enumerate(tree):
        key = f"{name}[{i}]"
        if isinstance(frame, list):
            while len(frame) == 1 and isinstance(frame[0], list):  # of a batch
                frame = frame[0]
            yield None, key, frame
        else:
            stated = entries.get(frame, "frame_id")
            number = None if stated is None else entries.whole(content, f"{key}.frame_id", stated)
            yield (
                number,
                f"{key}.instances",
                list(entries.rows(content, f"{key}.instances", frame, "instances")),
            )


def _landmarks(content: Content, key: str, one: Any, count: int) -> tuple[Array, Array]:
    """Coordinates (J, 2 or 3) and scores (J,) of an instance."""
    points = entries.floats(content, f"{key}.keypoints", entries.get(one, "keypoints"))
    if points.ndim == 3 and len(points) == 1:
        points = points[0]
    scores = entries.floats(content, f"{key}.keypoint_scores", entries.get(one, "keypoint_scores")).reshape(
        -1
    )
    if points.ndim != 2 or points.shape[1] not in (2, 3) or len(points) != len(scores):
        shapes = f"shapes {points.shape} and {scores.shape}"
        raise content.fail(f"{key}.keypoints", shapes, "(J, 2) or (J, 3), with keypoint_scores (J,)")
    if count and len(points) != count:
        raise content.fail(
            f"{key}.keypoints", f"{counted(len(points), 'landmark')} after {count}", "the same number"
        )
    return points, scores


def _has_depth(detections: list[Detection], depths: list[Array]) -> bool:
    """Whether the third coordinates are places in space, not confidences beside pixels."""
    if not detections or not np.isfinite(np.concatenate(depths)).any():
        return False
    size = np.median([anatomy.sizes(one.points_px[None])[0] for one in detections])
    third = np.concatenate(depths)
    third = third[np.isfinite(third)]
    return bool(size < pixels.PERSON_MIN_PX or third.min() < -0.5 or third.max() > 2)


def _in_space(
    content: Content,
    detections: list[Detection],
    depths: list[Array],
    names: tuple[str, ...] | layouts.Order,
    options: Options,
    notes: str,
) -> Evidence:
    """Evidence of one person of a lifter, followed by names or by what is seen of them along two axes."""
    track, how = following.follow(content, detections, options.person)
    joints = np.stack([np.concatenate((one.points_px, depths[one.index][:, None]), axis=1) for one in track])
    frames = np.array([one.frame for one in track])
    notes = "; ".join(part for part in (notes, how) if part)
    return solid.to_evidence(content, frames, joints, names, options, notes)


def _meta(content: Content, count: int) -> tuple[str, ...] | layouts.Order:
    """Names that `meta_info` gives, else by number."""
    meta = entries.get(content.tree, "meta_info") if content.kind == "json" else None
    table = meta.get("keypoint_id2name") if isinstance(meta, Mapping) else None
    if isinstance(table, Mapping) and len(table) == count:
        labels = [table.get(str(i), table.get(i, "")) for i in range(count)]
        if any(layouts.known(labels)) and count < 100:
            return layouts.known(labels)
    return ORDER


def _is_frame(one: Any) -> bool:
    return isinstance(one, Mapping) and isinstance(one.get("instances"), list)


def _is_people(tree: Any) -> bool:
    """Whether this is a list of instances, or of such a list in a batch."""
    while isinstance(tree, list) and len(tree) == 1 and isinstance(tree[0], list):
        tree = tree[0]
    return (
        isinstance(tree, list)
        and bool(tree)
        and all(isinstance(one, Mapping) and {"keypoints", "keypoint_scores"} <= set(one) for one in tree)
    )


def _parsed(content: Content) -> Any:
    """The first file of a folder that has people in it."""
    for path in content.json_files[:32]:
        if (tree := json_or_none(path)) != []:
            return tree
    return None
