"""When feet rest and parts touch, as pure functions of arrays (docs/metrics.md).

Axes: T frames, F foot points, C body parts; leading axes are batches.
"""

from __future__ import annotations

import numpy as np

from simrecon.contact import rules
from simrecon.metrics.smoothness import steps
from simrecon.types import Array, Flags

CONTACTS_MIN = 6
"""Steps of resting foot points of which a score is made, at least."""


def both(flags: Flags) -> Flags:
    """True for steps between frames that both hold, (..., T, F) → (..., T - 1, F)."""
    return np.asarray(flags[..., 1:, :] & flags[..., :-1, :])


def reference_contacts(truth_feet: Array, interval_s: float) -> Flags:
    """Where the reference's foot points rest, (..., T, F, 3) → (..., T - 1, F), by the frame they arrive at.

    By `contact.rules.reference_contacts`.
    """
    return rules.reference_contacts(truth_feet[..., 2], steps(truth_feet) / interval_s)


def frame_contacts(step_contacts: Flags) -> Flags:
    """Contacts by frame from `reference_contacts`: the first frame takes those of the second.

    (..., T - 1, F) → (..., T, F).
    """
    return np.concatenate((step_contacts[..., :1, :], step_contacts), axis=-2)


def contact_f1(contacts: Flags, truth: Flags) -> Array:
    """F1 score of contact of each part, (..., T, C), (..., T, C) → (..., C); NaN where neither has contact.

    2 TP / (2 TP + FP + FN) over frames; Rempe 2020 table 1 gives it for the feet.
    """
    both_have = (contacts & truth).sum(-2)
    one_has = (contacts ^ truth).sum(-2)
    count = 2 * both_have + one_has
    return np.asarray(np.where(count > 0, 2 * both_have / np.maximum(count, 1), np.nan))
