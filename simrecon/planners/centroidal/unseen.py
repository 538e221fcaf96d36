"""Feet that the evidence never shows: their contacts are those of a pose that was made up."""

from __future__ import annotations

import numpy as np

from simrecon.body import names
from simrecon.contact.parts import SIDES
from simrecon.types import Evidence, Flags

ENDS = ("ankle", "heel", "toe", "mtp")
SCORE = 0.1
"""A landmark below it is not seen."""


def feet(evidence: Evidence) -> tuple[str, ...]:
    """A note for each foot without a landmark and without a joint in any frame.

    None for evidence without points at all: of a motion on another body, whose points were seen on the first.
    """
    if not evidence.keypoint_names and not evidence.joint_names:
        return ()
    shown = _shown(evidence.keypoint_names, evidence.scores.max(axis=0, initial=0.0) >= SCORE)
    shown |= _shown(evidence.joint_names, np.isfinite(evidence.joints_m).all(axis=2).sum(axis=0) > 0)
    return tuple(
        f"the {side} foot is never seen; its contacts are guessed from the pose"
        for side in SIDES
        if not shown & {f"{side}_{end}" for end in ENDS}
    )


def _shown(known: tuple[str, ...], flags: Flags) -> set[str]:
    """Points of the body that are there in some frame."""
    points = [str(point["name"]) for point in names.points()]
    rows = names.resolve(known)
    return {points[row] for row, flag in zip(rows, flags, strict=True) if flag and row != names.IGNORED}
