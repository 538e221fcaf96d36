"""Clearance of parts of a body over what supports them, and how deep they are in it; by frame.

Axes: T frames, C body parts; leading axes are batches. Clearance is the signed height or distance of the
lowest point over its support, negative = sunk in.
"""

from __future__ import annotations

import numpy as np

from simrecon.contact import rules
from simrecon.types import Array, Flags

PENETRATION_TOLERANCE_M = 0.005
"""Depth from which a frame counts as penetrating: soft contact sinks in by a few millimetres."""


def box_clearance(position: Array, rotation: Array, half_size: Array, support: Array | float = 0.0) -> Array:
    """Signed height of a box's lowest corner over its support; negative = sunk in.

    Args:
        position: (..., 3) centre in the world.
        rotation: (..., 3, 3) box to world.
        half_size: (3,) or (..., 3).
        support: height of the ground, or of what is under the box, (...).
    """
    reach = (np.abs(rotation[..., 2, :]) * half_size).sum(-1)  # (...)
    return np.asarray(position[..., 2] - reach - support)


def penetration_depths(clearance: Array) -> Array:
    """Depth of the deepest part, m, zero where none is inside; (..., T, C) → (..., T)."""
    return np.asarray(np.maximum(0.0, -clearance.min(-1)))


def penetrating_frames(clearance: Array) -> Flags:
    """Frames with any part of the body deeper in than a tolerance, (..., T, C) → (..., T).

    Over the whole body, where the papers look at the feet.
    """
    return np.asarray((clearance < -PENETRATION_TOLERANCE_M).any(-1))


def flight_frames(clearance: Array) -> Flags:
    """Frames in which no part is nearer to its support than 5 cm, nor in the frames beside, (T, C) → (T,).

    The frames beside are left out because forces and accelerations are of an interval.
    """
    high = rules.flies(clearance)
    padded = np.concatenate((high[:1], high, high[-1:]))
    return np.asarray(padded[:-2] & padded[1:-1] & padded[2:])
