"""What the scene is to do to what a user wishes to touch, for the loss of the simulation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from simrecon.contact import honoured
from simrecon.contact.parts import parts
from simrecon.engines.wished import LEAD_S, led
from simrecon.kinematics.touched import touched
from simrecon.types import Array, IntArray, KinematicFit, Reference


@dataclass(frozen=True, eq=False)
class Borne:
    """K segments of the body on which parts lie that are to touch; T frames.

    Attributes:
        segments: their names.
        wrenches: (T, K, 6) what the plan has the scene do: moment about the world's origin, and force.
        places_m: (T, K, 3) where the plan has the scene push them; moments are compared about those.
        sure: (T, K) 1 where a part of a segment is to touch, else 0.
    """

    segments: tuple[str, ...]
    wrenches: Array
    places_m: Array
    sure: Array

    def at(self, frames: IntArray) -> Self:
        """That of some frames."""
        return type(self)(self.segments, self.wrenches[frames], self.places_m[frames], self.sure[frames])


def borne(fit: KinematicFit, reference: Reference) -> Borne | None:
    """What segments are to bear of which a part is to touch, as the planner has it.

    Args:
        fit: with the wishes.
        reference: with the forces of a planner that honours them.

    Returns:
        None if nothing is to touch, or the planner knows no forces.
    """
    if fit.wished is None or reference.contact_force_N is None or reference.contact_place_m is None:
        return None
    found = touched(fit.body, fit.scene, reference.qpos, fit.times_s)
    asked = honoured.possible(fit.wished, found.clearance_m)
    lead = round(LEAD_S / float(np.median(np.diff(fit.times_s))))
    on = {primitive.name: primitive.segment for primitive in fit.body.primitives}
    sure: dict[str, Array] = {}
    for column, part in enumerate(parts()):
        touch = led(asked.touch[:, column], asked.free[:, column], lead)
        for segment in {on[name] for name in part.at} if touch.any() else ():
            sure[segment] = np.maximum(sure.get(segment, 0.0), touch)
    if not sure:
        return None
    own = np.array([[name == segment for name in reference.contact_segments] for segment in sure], float)
    force, place = reference.contact_force_N, reference.contact_place_m
    size = np.linalg.norm(force, axis=-1) + 1e-6  # so that a place is known where nothing pushes
    weight = own * size[:, None]  # (T, K, C)
    middle = weight @ place / weight.sum(axis=-1, keepdims=True)
    wrenches = own @ np.concatenate((np.cross(place, force), force), axis=-1)
    return Borne(tuple(sure), wrenches, middle, np.stack(list(sure.values()), axis=1).astype(float))
