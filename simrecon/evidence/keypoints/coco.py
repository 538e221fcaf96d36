"""COCO and AlphaPose: lists of people with `image_id` and `keypoints`.

- COCO: a list of results {`image_id`, `keypoints`, `score`}, or a dataset with `annotations`, `images` and
  `categories`. In a dataset the third number is a visibility: 0 not labelled, 1 hidden, 2 seen.
- AlphaPose: a list of results with `image_id` as a file name, `score`, and `idx` of the person.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from simrecon.evidence.content import Content
from simrecon.evidence.keypoints import entries, layouts, tracks
from simrecon.evidence.options import Options
from simrecon.types import Evidence

HIDDEN_SCORE = 0.5


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


def _is_results(tree: Any) -> bool:
    return (
        isinstance(tree, list)
        and bool(tree)
        and isinstance(tree[0], Mapping)
        and {"image_id", "keypoints"} <= set(tree[0])
    )


def read_coco(content: Content, options: Options) -> Evidence:
    """Evidence of COCO's results or of a COCO dataset."""
    if isinstance(content.tree, list):
        return _results(content, content.tree, options, ("coco_17", "wholebody_133", "halpe_26", "halpe_136"))
    images = {one.get("id"): one for one in content.tree["images"] if isinstance(one, Mapping)}
    order = {name: i for i, name in enumerate(sorted(images, key=lambda key: _image_order(images[key])))}
    numbers = {key: entries.number(str(images[key].get("file_name", "")), order[key]) for key in images}
    if len(set(numbers.values())) < len(numbers):
        numbers = order
    detections, count = [], 0
    for k, one in enumerate(content.tree["annotations"]):
        key = f"annotations[{k}]"
        values = entries.triples(content, f"{key}.keypoints", entries.get(one, "keypoints"), count)
        count = len(values)
        if entries.get(one, "image_id") not in numbers:
            raise content.fail(f"{key}.image_id", repr(entries.get(one, "image_id")), "an id of images")
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
    return _results(content, content.tree, options, layouts.BY_COUNT)


def _category(content: Content, count: int) -> tuple[str, ...]:
    for one in content.tree.get("categories", ()):
        if isinstance(one, Mapping) and len(one.get("keypoints", ())) == count:
            return layouts.known(one["keypoints"])
    return layouts.by_count(content, "annotations", count, ("coco_17", "wholebody_133"))


def _results(content: Content, tree: Sequence[Any], options: Options, allowed: Sequence[str]) -> Evidence:
    ids = [entries.get(one, "image_id") for one in tree]
    for k, name in enumerate(ids):
        if not isinstance(name, (int, str)):
            there = "no such key" if name is None else f"a {type(name).__name__}"
            raise content.fail(f"[{k}].image_id", there, "a number or a file name")
    order = {name: i for i, name in enumerate(sorted(set(ids), key=lambda name: (str(type(name)), name)))}
    detections, count = [], 0
    for k, one in enumerate(tree):
        values = entries.triples(content, f"[{k}].keypoints", entries.get(one, "keypoints"), count)
        count = len(values)
        name = one["image_id"]
        frame = name if type(name) is int else entries.number(str(name), order[name])
        who = one.get("idx", one.get("track_id"))
        who = who[0] if isinstance(who, list) and who else who
        detections.append(
            tracks.detection(
                frame, values[:, :2], values[:, 2], None if isinstance(who, (list, type(None))) else str(who)
            )
        )
    names = layouts.by_count(content, "keypoints", count, allowed)
    return tracks.to_evidence(content, detections, names, options)


def _image_order(image: Mapping[str, Any]) -> tuple[int, str]:
    name = str(image.get("file_name", image.get("id")))
    return entries.number(name, 0), name
