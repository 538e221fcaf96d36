"""FreeMoCap: arrays (T, 33 or more, 3) triangulated from several cameras, mm; BlazePose's 33 come first.

`mediapipe_body_3d_xyz.npy` has 33, `mediaPipeSkel_3d_body_hands_face.npy` 33 of the body, 21 of each hand and
468 or 478 of the face. The up axis is z after its alignment with the floor, another one before.
"""

from __future__ import annotations

import numpy as np

from simrecon.evidence.content import Content
from simrecon.evidence.keypoints import anatomy, entries, layouts, solid
from simrecon.evidence.options import Options
from simrecon.types import Evidence

BODY = 33
COUNTS = (BODY, 75, 543, 553)
"""Body; with two hands; with the face; with the irises."""
SIZE_MIN = 100.0
"""Nobody is so small in millimetres."""
TRUST = "mocap,joints_m=0.03,place_m=0.03,assume=0.1"
"""Centimetres: a network's landmarks, triangulated from a few webcams."""


def matches(content: Content) -> bool:
    """FreeMoCap's arrays: BlazePose's landmarks in millimetres."""
    tree = content.tree if content.kind == "npy" else None
    if not isinstance(tree, np.ndarray) or tree.dtype.kind != "f" or tree.ndim != 3 or not len(tree):
        return False
    if tree.shape[1] not in COUNTS or tree.shape[2] != 3:
        return False
    third = tree[:, :BODY, 2][np.isfinite(tree[:, :BODY, 2])]
    if not len(third) or (third.min() >= 0 and third.max() <= 2):  # confidences
        return False
    with np.errstate(over="ignore"):
        sizes = anatomy.sizes(tree[:, :BODY].astype(float))
    return bool((sizes > 0).any() and np.median(sizes[sizes > 0]) > SIZE_MIN)


def read(content: Content, options: Options) -> Evidence:
    """Evidence of the body's landmarks."""
    values = entries.floats(content, "array", content.tree)
    note = f"the body's {BODY} of {values.shape[1]}" if values.shape[1] > BODY else ""
    names = layouts.layout("blazepose_33")
    frames = np.arange(len(values))
    return solid.to_evidence(content, frames, values[:, :BODY], names, options, note, trust=TRUST)
