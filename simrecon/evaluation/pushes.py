"""Contact and touch by force: which parts of the body the scene pushes, against where the reference touches.

Axes: T frames, C primitives, P parts.
"""

from __future__ import annotations

import numpy as np

from simrecon.contact import rules
from simrecon.contact.rules import Flags
from simrecon.evaluation.comparison import Comparison
from simrecon.metrics import contact, pose, touch
from simrecon.metrics.rates import at
from simrecon.types import Motion

# Primitives of the parts that `metrics.bones` puts capsules or points on; left side and centre only.
_PRIMITIVES = {
    "pelvis": ("pelvis", "left_buttock", "right_buttock"),
    "trunk": ("abdomen", "waist", "ribs", "thorax", "left_clavicle", "right_clavicle"),
    "left_thigh": ("left_thigh",),
    "left_shank": ("left_calf", "left_shin"),
    "left_upper_arm": ("left_upper_arm",),
    "left_forearm": ("left_forearm", "left_hand"),
    "left_foot": ("left_foot",),
}
_POINTS = {"left_foot": ("left_heel", "left_toe")}


def contact_f1(motion: Motion, on: Comparison) -> float:
    """F1 of contact, mean over parts: which the scene pushes against where the reference touches."""
    loaded = _loaded(motion, on)  # (T, C)
    pushed, touching = [], []
    for name, primitives in _PRIMITIVES.items():
        for side in {name, name.replace("left_", "right_", 1)}:
            own = [motion.contact_body.index(p) for p in _of_side(primitives, side)]
            parts = [p for p in _of_side(_POINTS.get(name, (name,)), side) if p in on.parts.names]
            if parts:
                pushed.append(loaded[:, own].any(-1))
                touching.append(on.touching[:, [on.parts.names.index(p) for p in parts]].any(-1))
    f1 = contact.contact_f1(np.stack(pushed, axis=-1), np.stack(touching, axis=-1))
    return float(pose.mean_known(f1, (0,)))


def touch_f1(motion: Motion, on: Comparison) -> dict[str, float]:
    """F1 of the parts (`touch.PARTS`) that the scene pushes against those that the reference touches with."""
    return touch.scores(_pushed(motion, on), on.near, "touch_f1_force")


def _pushed(motion: Motion, on: Comparison) -> Flags:
    """Which parts of the body (`touch.PARTS`) the scene pushes, (T, P)."""
    loaded = _loaded(motion, on)  # (T, C)
    columns = []
    for name, capsules in touch.PARTS.items():
        is_foot = name.replace("_foot", "_heel") == capsules[0]
        primitives = [name] if is_foot else [p for part in capsules for p in _primitives(part)]
        columns.append(loaded[:, [motion.contact_body.index(p) for p in primitives]].any(-1))
    return np.stack(columns, axis=-1)


def _loaded(motion: Motion, on: Comparison) -> Flags:
    """Which primitives the scene pushes (`contact.rules.loaded`) at the times compared, (T, C)."""
    force = at(on.times_s, motion.times_s, motion.contact_force_N)  # (T, C, 3)
    return rules.loaded(np.linalg.norm(force, axis=-1))


def _primitives(part: str) -> list[str]:
    """Primitives of a part, on its side."""
    return _of_side(_PRIMITIVES[part.replace("right_", "left_", 1)], part)


def _of_side(names: tuple[str, ...], side: str) -> list[str]:
    if not side.startswith("right_"):
        return list(names)
    return [name.replace("left_", "right_", 1) for name in names]
