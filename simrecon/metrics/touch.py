"""Touch: which parts of the body are within 2 cm of the scene, at rest or moving (docs/metrics.md).

Contact at rest (`bones.touching`) leaves nothing to score of a roll or a landing, whose parts touch in
passing. Axes: T frames, C capsules, P parts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simrecon.contact import rules
from simrecon.metrics.contact import contact_f1
from simrecon.types import Array, Flags

FRAMES_MIN = 3
PARTS: dict[str, tuple[str, ...]] = {
    "back": ("pelvis", "trunk"),
    "left_arm": ("left_upper_arm", "left_forearm"),
    "right_arm": ("right_upper_arm", "right_forearm"),
    "left_leg": ("left_thigh", "left_shank"),
    "right_leg": ("right_thigh", "right_shank"),
    "left_foot": ("left_heel", "left_toe"),
    "right_foot": ("right_heel", "right_toe"),
}
"""Capsules of `bones.bones` by part; an arm ends at the wrist, a leg holds the knee."""


def parts(flags: Flags, capsules: Sequence[str]) -> Flags:
    """Which parts have a capsule that is flagged, (T, C) → (T, P)."""
    columns = [[capsules.index(name) for name in names if name in capsules] for names in PARTS.values()]
    return np.stack([flags[:, own].any(-1) for own in columns], axis=-1)


def near(clearance_m: Array, capsules: Sequence[str]) -> Flags:
    """Which parts are within 2 cm of the scene, (T, C) → (T, P)."""
    return parts(rules.near(clearance_m), capsules)


def scores(touches: Flags, truth: Flags, prefix: str = "touch_f1") -> dict[str, float]:
    """F1 of the parts (T, P) that the reference touches with in three frames or more.

    Returns:
        `<prefix>` their mean, `<prefix>_least` the worst, and `<prefix>_<part>`; empty if there is none.
    """
    f1 = contact_f1(touches, truth)
    known = {
        name: float(f1[column]) for column, name in enumerate(PARTS) if truth[:, column].sum() >= FRAMES_MIN
    }
    if not known:
        return {}
    whole = {prefix: float(np.mean(list(known.values()))), f"{prefix}_least": min(known.values())}
    return whole | {f"{prefix}_{name}": value for name, value in known.items()}
