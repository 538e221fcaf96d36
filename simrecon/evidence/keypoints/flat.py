"""OpenPose, COCO, MMPose and AlphaPose JSON: lists of people with their landmarks.

- OpenPose: a folder of files, one a frame, with `people[].pose_keypoints_2d` (x, y, confidence).
- COCO: a list of results {`image_id`, `keypoints`, `score`}, or a dataset with `annotations`, `images` and
  `categories`. In a dataset the third number is a visibility: 0 not labelled, 1 hidden, 2 seen.
- AlphaPose: a list of results with `image_id` as a file name, `score`, and `idx` of the person.
- an array (T, J, 3) of x, y and confidence, as GVHMR keeps in `vitpose.pt`.
- MMPose, RTMPose: `instance_info[{frame_id, instances[{keypoints, keypoint_scores}]}]` with `meta_info`.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from simrecon.evidence.content import Content, as_array, open_content
from simrecon.evidence.keypoints import layouts, tracks
from simrecon.evidence.keypoints.tracks import Detection
from simrecon.evidence.options import Options
from simrecon.types import Array, Evidence

HIDDEN_SCORE = 0.5
OPENPOSE = ("openpose_25", "openpose_18")
ALPHAPOSE = ("coco_17", "halpe_26", "wholebody_133", "halpe_136")


def matches_openpose(content: Content) -> bool:
    """A folder of OpenPose's files, or one of them."""
    if content.kind == "folder":
        return bool(content.json_files) and _is_frame(_parsed(content, 0))
    return content.kind == "json" and _is_frame(content.tree)


def matches_coco(content: Content) -> bool:
    """COCO's results or a COCO dataset."""
    tree = content.tree if content.kind == "json" else None
    if isinstance(tree, Mapping):
        return isinstance(tree.get("annotations"), list) and "images" in tree
    return _is_results(tree) and not matches_alphapose(content)


def matches_alphapose(content: Content) -> bool:
    """AlphaPose's results: COCO's with file names."""
    tree = content.tree if content.kind == "json" else None
    return isinstance(tree, list) and _is_results(tree) and isinstance(tree[0]["image_id"], str)


def matches_mmpose(content: Content) -> bool:
    """MMPose's predictions."""
    tree = content.tree if content.kind == "json" else None
    return isinstance(tree, Mapping) and "instance_info" in tree


def matches_array(content: Content) -> bool:
    """An array of landmarks by frame."""
    tree = content.tree if content.kind in ("torch", "npy", "pickle") else None
    sizes = {len(layouts.layout(name)) for name in ALPHAPOSE}
    return isinstance(tree, np.ndarray) and tree.ndim == 3 and tree.shape[2] == 3 and tree.shape[1] in sizes


def _is_frame(tree: Any) -> bool:
    return isinstance(tree, Mapping) and isinstance(tree.get("people"), list)


def _is_results(tree: Any) -> bool:
    return (
        isinstance(tree, list)
        and bool(tree)
        and isinstance(tree[0], Mapping)
        and {"image_id", "keypoints"} <= set(tree[0])
    )


def read_openpose(content: Content, options: Options) -> Evidence:
    """Evidence of a folder of OpenPose's files."""
    if content.kind != "folder":
        raise content.fail("people", "a single frame", "the folder with the files of all frames")
    detections: list[Detection] = []
    count = 0
    for i, path in enumerate(content.json_files):
        one = open_content(path)
        if not _is_frame(one.tree):
            raise one.fail("people", "no such list", "OpenPose's file of a frame")
        frame = _number(path.name.removesuffix("_keypoints.json"), i)
        for k, person in enumerate(one.tree["people"]):
            values = _triples(one, f"people[{k}].pose_keypoints_2d", _get(person, "pose_keypoints_2d"), count)
            count = len(values)
            ids = person.get("person_id")
            who = str(ids[0]) if isinstance(ids, list) and ids and ids[0] not in (-1, None) else None
            detections.append(tracks.detection(frame, values[:, :2], values[:, 2], who))
    names = layouts.by_count(content, "pose_keypoints_2d", count, OPENPOSE) if detections else ()
    return tracks.to_evidence(content, detections, names, options, f"{len(content.json_files)} files")


def read_coco(content: Content, options: Options) -> Evidence:
    """Evidence of COCO's results or of a COCO dataset."""
    if isinstance(content.tree, list):
        return _results(content, content.tree, options, ("coco_17", "wholebody_133", "halpe_26", "halpe_136"))
    images = {one.get("id"): one for one in content.tree["images"] if isinstance(one, Mapping)}
    order = {name: i for i, name in enumerate(sorted(images, key=lambda key: _image_order(images[key])))}
    numbers = {key: _number(str(images[key].get("file_name", "")), order[key]) for key in images}
    if len(set(numbers.values())) < len(numbers):
        numbers = order
    detections, count = [], 0
    for k, one in enumerate(content.tree["annotations"]):
        key = f"annotations[{k}]"
        values = _triples(content, f"{key}.keypoints", _get(one, "keypoints"), count)
        count = len(values)
        if _get(one, "image_id") not in numbers:
            raise content.fail(f"{key}.image_id", repr(_get(one, "image_id")), "an id of images")
        scores = np.where(values[:, 2] == 1, HIDDEN_SCORE, values[:, 2])
        who = one.get("track_id", one.get("instance_id"))
        detections.append(
            tracks.detection(
                numbers[one["image_id"]], values[:, :2], scores, None if who is None else str(who)
            )
        )
    return tracks.to_evidence(
        content, detections, _category(content, count) if detections else (), options, "a COCO dataset"
    )


def read_alphapose(content: Content, options: Options) -> Evidence:
    """Evidence of AlphaPose's results."""
    return _results(content, content.tree, options, ALPHAPOSE)


def _category(content: Content, count: int) -> tuple[str, ...]:
    for one in content.tree.get("categories", ()):
        if isinstance(one, Mapping) and len(one.get("keypoints", ())) == count:
            return layouts.known(one["keypoints"])
    return layouts.by_count(content, "annotations", count, ("coco_17", "wholebody_133"))


def _results(content: Content, tree: Sequence[Any], options: Options, allowed: Sequence[str]) -> Evidence:
    ids = [_get(one, "image_id") for one in tree]
    for k, name in enumerate(ids):
        if not isinstance(name, (int, str)):
            there = "no such key" if name is None else f"a {type(name).__name__}"
            raise content.fail(f"[{k}].image_id", there, "a number or a file name")
    order = {name: i for i, name in enumerate(sorted(set(ids), key=lambda name: (str(type(name)), name)))}
    detections, count = [], 0
    for k, one in enumerate(tree):
        values = _triples(content, f"[{k}].keypoints", _get(one, "keypoints"), count)
        count = len(values)
        name = one["image_id"]
        frame = name if type(name) is int else _number(str(name), order[name])
        who = one.get("idx", one.get("track_id"))
        who = who[0] if isinstance(who, list) and who else who
        detections.append(
            tracks.detection(
                frame, values[:, :2], values[:, 2], None if isinstance(who, (list, type(None))) else str(who)
            )
        )
    names = layouts.by_count(content, "keypoints", count, allowed)
    return tracks.to_evidence(content, detections, names, options)


def read_array(content: Content, options: Options) -> Evidence:
    """Evidence of an array of landmarks."""
    values = _floats(content, "array", content.tree)
    names = layouts.by_count(content, "array", values.shape[1], ALPHAPOSE)
    detections = [tracks.detection(t, row[:, :2], row[:, 2]) for t, row in enumerate(values)]
    return tracks.to_evidence(content, detections, names, options)


def read_mmpose(content: Content, options: Options) -> Evidence:
    """Evidence of MMPose's predictions."""
    detections, count = [], 0
    frames = content.tree["instance_info"]
    if not isinstance(frames, list):
        raise content.fail("instance_info", f"a {type(frames).__name__}", "a list of frames")
    for i, frame in enumerate(frames):
        number = _get(frame, "frame_id") if isinstance(frame, Mapping) and "frame_id" in frame else i
        for k, one in enumerate(_list(content, f"instance_info[{i}].instances", frame, "instances")):
            key = f"instance_info[{i}].instances[{k}]"
            points = _floats(content, f"{key}.keypoints", _get(one, "keypoints"))
            scores = _floats(content, f"{key}.keypoint_scores", _get(one, "keypoint_scores")).reshape(-1)
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
    allowed = ("coco_17", "halpe_26", "wholebody_133", "halpe_136")
    return layouts.by_count(content, "instance_info", count, allowed)


def _parsed(content: Content, index: int) -> Any:
    try:
        return json.loads(content.json_files[index].read_bytes()[: 1 << 24])
    except (OSError, ValueError, RecursionError):
        return None


def _get(one: Any, key: str) -> Any:
    return one.get(key) if isinstance(one, Mapping) else None


def _list(content: Content, key: str, one: Any, name: str) -> Iterator[Any]:
    rows = _get(one, name)
    if not isinstance(rows, list):
        raise content.fail(key, f"a {type(rows).__name__}", "a list")
    return iter(rows)


def _floats(content: Content, key: str, value: Any) -> Array:
    array = as_array(value)
    if array is None or array.dtype.kind not in "fiu":
        raise content.fail(key, "no list of numbers" if value is not None else "no such key", "numbers")
    return array.astype(float)


def _triples(content: Content, key: str, value: Any, count: int) -> Array:
    """A flat list of x, y and confidence, (J, 3)."""
    flat = _floats(content, key, value).reshape(-1)
    if len(flat) % 3 or (count and len(flat) != 3 * count):
        valid = "x, y, confidence of each landmark" + (f", {count} landmarks" if count else "")
        raise content.fail(key, f"{len(flat)} numbers", valid)
    return flat.reshape(-1, 3)


def _number(name: str, fallback: int) -> int:
    """The last number in a file name without its ending: that of the frame."""
    digits = re.findall(r"\d+", name.rsplit("/", 1)[-1].rsplit(".", 1)[0])
    return int(digits[-1]) if digits and len(digits[-1]) < 13 else fallback


def _image_order(image: Mapping[str, Any]) -> tuple[int, str]:
    name = str(image.get("file_name", image.get("id")))
    return _number(name, 0), name
