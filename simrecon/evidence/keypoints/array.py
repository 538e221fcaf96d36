"""An array (T, J, 3) of x, y and confidence, as GVHMR keeps in `vitpose.pt`."""

from __future__ import annotations

import numpy as np

from simrecon.evidence.content import Content
from simrecon.evidence.keypoints import entries, layouts, tracks
from simrecon.evidence.options import Options
from simrecon.types import Evidence


def matches(content: Content) -> bool:
    """An array of landmarks by frame."""
    tree = content.tree if content.kind in ("torch", "npy", "pickle") else None
    sizes = {len(layouts.layout(name)) for name in layouts.BY_COUNT}
    return isinstance(tree, np.ndarray) and tree.ndim == 3 and tree.shape[2] == 3 and tree.shape[1] in sizes


def read(content: Content, options: Options) -> Evidence:
    """Evidence of an array of landmarks."""
    values = entries.floats(content, "array", content.tree)
    names = layouts.by_count(content, "array", values.shape[1], layouts.BY_COUNT)
    detections = [tracks.detection(t, row[:, :2], row[:, 2]) for t, row in enumerate(values)]
    return tracks.to_evidence(content, detections, names, options)
