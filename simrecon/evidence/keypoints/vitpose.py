"""easy_ViTPose: `keypoints`, a list of frames, each of people by id, and `skeleton`, the names of landmarks.

A landmark is y, x and confidence (`VitInference.inference`). Where a person would then lie, but stands
with x before y, they have been put in order already.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from simrecon.evidence.content import Content
from simrecon.evidence.keypoints import entries, layouts, pixels, tracks
from simrecon.evidence.keypoints.following import Detection
from simrecon.evidence.options import Options
from simrecon.types import Array, Evidence

STANDS = 0.8


def matches(content: Content) -> bool:
    """easy_ViTPose's predictions."""
    tree = content.tree if content.kind == "json" else None
    if not isinstance(tree, Mapping) or not isinstance(tree.get("keypoints"), list):
        return False
    frames = tree["keypoints"]
    return isinstance(tree.get("skeleton"), Mapping) and all(isinstance(one, Mapping) for one in frames[:32])


def read(content: Content, options: Options) -> Evidence:
    """Evidence of easy_ViTPose's predictions."""
    names = _names(content)
    people: list[tuple[int, str, Array]] = []
    for t, frame in enumerate(content.tree["keypoints"]):
        if not isinstance(frame, Mapping):
            raise content.fail(f"keypoints[{t}]", f"a {type(frame).__name__}", "people by id")
        for who, one in frame.items():
            if entries.lacks(frame, who):
                continue
            values = entries.floats(content, f"keypoints[{t}].{who}", one)
            if values.shape != (len(names), 3):
                valid = f"({len(names)}, 3): y, x, confidence of each name in skeleton"
                raise content.fail(f"keypoints[{t}].{who}", f"shape {values.shape}", valid)
            people.append((t, str(who), values))
    first = _first([values for _, _, values in people], names)
    detections: list[Detection] = [
        tracks.detection(t, values[:, [first, 1 - first]], values[:, 2], who) for t, who, values in people
    ]
    note = "y before x" if first else "x before y, by which the person stands"
    return tracks.to_evidence(content, detections, names, options, note)


def _names(content: Content) -> tuple[str, ...]:
    skeleton: Mapping[Any, Any] = content.tree["skeleton"]
    labels = [skeleton.get(str(i), skeleton.get(i, "")) for i in range(len(skeleton))]
    names = layouts.known(labels)
    if not any(names) or any("paw" in str(label).lower() for label in labels):
        raise content.fail("skeleton", ", ".join(map(str, labels[:6])), "the names of a person's landmarks")
    return names


def _first(people: list[Array], names: tuple[str, ...]) -> int:
    """Which of the first two columns is x."""
    if not people:
        return 1
    kept = [i for i, name in enumerate(names) if name]
    values = np.stack(people)[:, kept]
    up = pixels.upright(values[..., :2], [names[i] for i in kept])
    known = up[np.isfinite(up).all(axis=-1)]
    # downwards in the image is positive, so who stands has shoulders above, at smaller values
    stands = [float((-known[:, 1 - x] > np.abs(known[:, x])).mean()) if len(known) else 0.0 for x in (0, 1)]
    return 0 if stands[0] >= STANDS and stands[1] < 1 - STANDS else 1
