"""Contact and touch by force: which parts of the body the scene pushes, against where the reference touches.

Axes: T frames, C primitives, P parts.
"""

from __future__ import annotations

import numpy as np

from simrecon.contact import rules
from simrecon.evaluation import parts
from simrecon.evaluation.comparison import Comparison
from simrecon.metrics import contact, pose, touch
from simrecon.metrics.rates import at
from simrecon.types import Flags, Motion


def contact_f1(motion: Motion, on: Comparison) -> dict[str, float]:
    """F1 of contact by force, mean over parts.

    Returns:
        `contact_f1_force`: which the scene pushes, against where the reference's capsules touch.
        `contact_f1_true_force`: against where the reference is pushed, if that is known.
    """
    there = parts.known(on.parts.names)
    pushed = parts.of_primitives(_loaded(motion, on), motion.contact_body, there)
    touching = parts.of_capsules(on.touching, on.parts.names, there)
    scores = {"contact_f1_force": _mean_f1(pushed, touching)}
    if on.pushed is not None:
        scores["contact_f1_true_force"] = _mean_f1(pushed, on.pushed)
    return scores


def true_contact_f1(touching: Flags, on: Comparison) -> dict[str, float]:
    """F1 of a motion's own contacts, against where the reference is pushed, mean over parts.

    Args:
        touching: (T, C) which capsules of the motion touch, from `bones.touching`.
        on: what the motions are compared on.

    Returns:
        `contact_f1_true`; nothing where nobody knows what pushes the reference.
    """
    if on.pushed is None:
        return {}
    own = parts.of_capsules(touching, on.parts.names, parts.known(on.parts.names))
    return {"contact_f1_true": _mean_f1(own, on.pushed)}


def touch_f1(motion: Motion, on: Comparison) -> dict[str, float]:
    """F1 of the parts (`touch.PARTS`) that the scene pushes against those that the reference touches with."""
    return touch.scores(_pushed(motion, on), on.near, "touch_f1_force")


def _mean_f1(contacts: Flags, truth: Flags) -> float:
    return float(pose.mean_known(contact.contact_f1(contacts, truth), (0,)))


def _pushed(motion: Motion, on: Comparison) -> Flags:
    """Which parts of the body (`touch.PARTS`) the scene pushes, (T, P)."""
    loaded = _loaded(motion, on)  # (T, C)
    columns = []
    for name, capsules in touch.PARTS.items():
        is_foot = name.replace("_foot", "_heel") == capsules[0]
        primitives = [name] if is_foot else [p for part in capsules for p in parts.PRIMITIVES[part]]
        columns.append(loaded[:, [motion.contact_body.index(p) for p in primitives]].any(-1))
    return np.stack(columns, axis=-1)


def _loaded(motion: Motion, on: Comparison) -> Flags:
    """Which primitives the scene pushes (`contact.rules.loaded`) at the times compared, (T, C)."""
    force = at(on.times_s, motion.times_s, motion.contact_force_N)  # (T, C, 3)
    return rules.loaded(np.linalg.norm(force, axis=-1))
