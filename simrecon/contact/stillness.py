"""Labels by the rule that what is still rests (`rules.still`): the source `rules`."""

from __future__ import annotations

import numpy as np

from simrecon.contact import labels, rules
from simrecon.contact.cues import Cues
from simrecon.contact.parts import SEAT, TOES, parts
from simrecon.types import Array, ContactLabels


def label(cues: Cues) -> ContactLabels:
    """Feet that are still stand, and hips that are still sit; of other parts it says nothing."""
    points = {part.name: part.points for part in parts()}

    def resting(part: str) -> Array:
        return rules.still(*cues.places(points[part]), cues.interval_s)

    standing = np.stack([resting(part) for part in TOES])
    return labels.of_feet_and_hips(standing, resting(SEAT[0]), "rules")
