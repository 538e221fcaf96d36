"""MMPose, RTMPose: `instance_info[{frame_id, instances[{keypoints, keypoint_scores}]}]` with `meta_info`."""

from __future__ import annotations

from collections.abc import Mapping

from simrecon.evidence.content import Content
from simrecon.evidence.keypoints import entries, layouts, tracks
from simrecon.evidence.options import Options
from simrecon.types import Evidence


def matches(content: Content) -> bool:
    """MMPose's predictions."""
    tree = content.tree if content.kind == "json" else None
    return isinstance(tree, Mapping) and "instance_info" in tree


def read(content: Content, options: Options) -> Evidence:
    """Evidence of MMPose's predictions."""
    detections, count = [], 0
    frames = content.tree["instance_info"]
    if not isinstance(frames, list):
        raise content.fail("instance_info", f"a {type(frames).__name__}", "a list of frames")
    for i, frame in enumerate(frames):
        number = entries.get(frame, "frame_id") if isinstance(frame, Mapping) and "frame_id" in frame else i
        for k, one in enumerate(entries.rows(content, f"instance_info[{i}].instances", frame, "instances")):
            key = f"instance_info[{i}].instances[{k}]"
            points = entries.floats(content, f"{key}.keypoints", entries.get(one, "keypoints"))
            scores = entries.floats(
                content, f"{key}.keypoint_scores", entries.get(one, "keypoint_scores")
            ).reshape(-1)
            if points.ndim != 2 or points.shape[1] not in (2, 3) or len(points) != len(scores):
                shapes = f"shapes {points.shape} and {scores.shape}"
                raise content.fail(f"{key}.keypoints", shapes, "(J, 2), with keypoint_scores (J,)")
            if count and len(points) != count:
                raise content.fail(
                    f"{key}.keypoints", f"{len(points)} landmarks after {count}", "the same number"
                )
            count = len(points)
            who = one.get("track_id", one.get("instance_id"))
            detections.append(
                tracks.detection(int(number), points[:, :2], scores, None if who is None else str(who))
            )
    return tracks.to_evidence(content, detections, _meta(content, count) if detections else (), options)


def _meta(content: Content, count: int) -> tuple[str, ...]:
    """Names that `meta_info` gives, else by number."""
    meta = content.tree.get("meta_info")
    table = meta.get("keypoint_id2name") if isinstance(meta, Mapping) else None
    if isinstance(table, Mapping) and len(table) == count:
        labels = [table.get(str(i), table.get(i, "")) for i in range(count)]
        if any(layouts.known(labels)) and count < 100:
            return layouts.known(labels)
    return layouts.by_count(content, "instance_info", count, layouts.BY_COUNT)
