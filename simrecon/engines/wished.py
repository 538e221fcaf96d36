"""Where the points of the body are by what a user wishes of the contacts, for the loss of the simulation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.ndimage import binary_dilation

from simrecon.contact import honoured
from simrecon.contact.parts import parts
from simrecon.kinematics.touched import touched
from simrecon.types import Array, Flags, IntArray, KinematicFit

PRESSED_M = 0.005
"""How far under its support a part is wanted that is to touch: what just reaches it does not push."""
LEAD_S = 0.1
"""A part that is to touch is led there from this long before, and held for this long after."""


@dataclass(frozen=True, eq=False)
class Wished:
    """What is wished of the points of the body; T frames, M points.

    Attributes:
        points_m: (T, M, 3) where they are wanted.
        sure: (T, M) 1 where a point belongs to a part that is to touch, else 0.
    """

    points_m: Array
    sure: Array

    def at(self, frames: IntArray) -> Self:
        """That of some frames."""
        return type(self)(self.points_m[frames], self.sure[frames])


def wished(fit: KinematicFit, qpos: Array, points_m: Array) -> Wished | None:
    """Where points of parts that are to touch are wanted: as in the reference, but pressed on what is there.

    What is to be free is left to the reference, which keeps it apart: held as strictly, it costs the balance.
    Wishes that cannot hold ask for nothing (`contact.honoured`).

    Args:
        fit: with the wishes.
        qpos: (T, nq) of the reference.
        points_m: (T, M, 3) of the reference.

    Returns:
        None if nothing is to touch.
    """
    if fit.wished is None:
        return None
    found = touched(fit.body, fit.scene, qpos, fit.times_s)
    asked = honoured.possible(fit.wished, found.clearance_m)
    lead = round(LEAD_S / float(np.median(np.diff(fit.times_s))))
    names = fit.body.skeleton.point_names
    wanted, sure = points_m.copy(), np.zeros(points_m.shape[:2])
    for column, part in enumerate(parts()):
        rows = [names.index(name) for name in part.held]
        touch = led(asked.touch[:, column], asked.free[:, column], lead)
        lift = np.maximum(found.clearance_m[:, column] + PRESSED_M, 0.0) * touch
        wanted[:, rows] -= (lift[:, None] * found.up[:, column])[:, None]
        sure[:, rows] = touch[:, None]
    return Wished(wanted, sure) if sure.any() else None


def led(flags: Flags, against: Flags, frames: int) -> Flags:
    """Flags (T,) that begin and end some frames earlier and later, except where the opposite is wished."""
    if not frames:
        return flags
    return np.asarray(binary_dilation(flags, iterations=frames) & ~against)
