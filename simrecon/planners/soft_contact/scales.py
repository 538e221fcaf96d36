"""Units of the laws of motion as a term, and what a force costs where it has neither distance nor slip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simrecon.plan import SoftContact
from simrecon.types import Array

SEATED = ("pelvis", "left_hip", "right_hip")
"""Segments on which one sits: the pelvis, and the thighs."""


@dataclass(frozen=True)
class Scales:
    """Units of the term.

    Attributes:
        share: σ, of force in body weights and of moment in these times stature.
        distance_m, slip_mps: σ_d and σ_v.
        rest: ε. seat: share of it that pelvis and thighs have.
        rate_per_s: σ_r, of the change of force and moment in these shares.
        place_m: σ_p, of the centre of mass about that of the fit.
    """

    share: float
    distance_m: float
    slip_mps: float
    rest: float
    seat: float
    rate_per_s: float
    place_m: float

    @classmethod
    def of(cls, asked: SoftContact) -> Scales:
        """Those that a plan asks for, in the unit of its first round."""
        return cls(
            share=asked.units[0],
            distance_m=asked.distance_m,
            slip_mps=asked.slip_mps,
            rest=asked.rest,
            seat=asked.seat,
            rate_per_s=asked.rate_per_s,
            place_m=asked.place_m,
        )

    def rests(self, segments: Sequence[str]) -> Array:
        """ε_i of contacts (G,) by the names of their segments: less of those on which one sits."""
        return np.where(np.isin(segments, SEATED), self.seat, 1.0) * self.rest
