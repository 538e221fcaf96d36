"""Labels by frame and part, made of what is known of feet and hips, and what is read from them."""

from __future__ import annotations

import numpy as np

from simrecon.contact.parts import HEELS, SEAT, TOES, names
from simrecon.types import Array, ContactLabels


def of_feet_and_hips(standing: Array, sitting: Array, source: str) -> ContactLabels:
    """Labels in which heel and toe of a foot touch together, as both buttocks do; of the rest nothing.

    Args:
        standing: (2, T) of the left and the right foot, 0 to 1.
        sitting: (T,) of the hips, 0 to 1.
        source: of the labels.
    """
    parts = names()
    probability = np.full((len(sitting), len(parts)), np.nan)
    for side, values in enumerate(standing):
        for name in (HEELS[side], TOES[side]):
            probability[:, parts.index(name)] = values
    for name in SEAT:
        probability[:, parts.index(name)] = sitting
    return ContactLabels(parts, probability, source)


def standing(labels: ContactLabels) -> Array:
    """How surely the left and the right foot stand: on heel or toe, (2, T)."""
    return np.stack([np.maximum(labels.of(h), labels.of(t)) for h, t in zip(HEELS, TOES, strict=True)])


def sitting(labels: ContactLabels) -> Array:
    """How surely the person sits: on either buttock, (T,)."""
    left, right = (labels.of(name) for name in SEAT)
    return np.maximum(left, right)
