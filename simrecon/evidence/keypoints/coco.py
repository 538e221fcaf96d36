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
ORDER = layouts.Order(
    "keypoints",
    (
        "coco_17", "h36m_17", "halpe_26", "openpose_25", "openpose_25b", "vitpose_25", "mpii_16", "aic_14",
        "crowdpose_14", "lsp_14", "openpose_18", "wholebody_133", "halpe_136",
    ),
)  # fmt: skip
ALPHAPOSE = layouts.Order("keypoints", ("coco_17", "halpe_26", "wholebody_133", "halpe_136"))


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
        return _results(content, content.tree, options, ORDER)
    images = {one.get("id"): one for one in content.tree["images"] if isinstance(one, Mapping)}
    listed, note = entries.numbers([str(one.get("file_name", key)) for key, one in images.items()])
    numbers = dict(zip(images, listed, strict=True))
    _check_size(content, images, options)
    detections, count = [], 0
    for k, one in enumerate(content.tree["annotations"]):
        key = f"annotations[{k}]"
        if entries.lacks(one, "keypoints"):
            continue
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
    names = _category(content, count) if detections else ()
    text = "; ".join(part for part in ("a COCO dataset", note) if part)
    return tracks.to_evidence(content, detections, names, options, text)


def read_alphapose(content: Content, options: Options) -> Evidence:
    """Evidence of AlphaPose's results."""
    return _results(content, content.tree, options, ALPHAPOSE)


def _category(content: Content, count: int) -> tuple[str, ...] | layouts.Order:
    for one in content.tree.get("categories", ()):
        if isinstance(one, Mapping) and len(one.get("keypoints", ())) == count:
            return layouts.known(one["keypoints"])
    return layouts.Order("annotations", ORDER.allowed)


def _check_size(content: Content, images: Mapping[Any, Mapping[str, Any]], options: Options) -> None:
    """The size that a dataset states of its images, against that of the lens."""
    sizes = {(one.get("width"), one.get("height")) for one in images.values()}
    if options.camera is None or len(sizes) != 1 or None in (size := next(iter(sizes))):
        return
    if tuple(size) != tuple(options.camera.lens.image_size_px):
        wide, high = options.camera.lens.image_size_px
        raise content.fail("images", f"{size[0]} x {size[1]} px for a lens of {wide} x {high} px", "one size")


def _results(content: Content, tree: Sequence[Any], options: Options, order: layouts.Order) -> Evidence:
    ids = [entries.get(one, "image_id") for one in tree]
    for k, name in enumerate(ids):
        if not isinstance(name, (int, str)):
            there = "no such key" if name is None else f"a {type(name).__name__}"
            raise content.fail(f"[{k}].image_id", there, "a number or a file name")
    named = sorted({name for name in ids if isinstance(name, str)})
    listed, note = entries.numbers(named)
    frames = dict(zip(named, listed, strict=True))
    detections, count, empty = [], 0, 0
    for k, one in enumerate(tree):
        if entries.lacks(one, "keypoints"):
            empty += 1
            continue
        values = entries.triples(content, f"[{k}].keypoints", entries.get(one, "keypoints"), count)
        count = len(values)
        name = one["image_id"]
        frame = frames[name] if isinstance(name, str) else int(name)
        who = one.get("idx", one.get("track_id"))
        who = who[0] if isinstance(who, list) and who else who
        detections.append(
            tracks.detection(
                frame, values[:, :2], values[:, 2], None if isinstance(who, (list, type(None))) else str(who)
            )
        )
    notes = [note, f"{empty} empty people left out" if empty else ""]
    text = "; ".join(part for part in notes if part)
    return tracks.to_evidence(content, detections, order, options, text)
