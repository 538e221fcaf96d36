"""The centre of mass against that of the reference, Gärtner et al. 2022 eq. 1."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from simrecon.engines.problem import Problem
from simrecon.engines.sampling.terms.moves import Moves
from simrecon.engines.sampling.terms.seen import Seen
from simrecon.engines.sampling.terms.term import LossTerm
from simrecon.optim import gauss_newton
from simrecon.types import Array


class ComPosition(LossTerm):
    """Where the centre of mass c is (eq. 1, first part)."""

    name = "com_position"

    def value(self, seen: Seen) -> Array:
        """Σ_t ‖c_t - c_t^k‖², m²."""
        value: Array = np.sum(seen.com_off_m**2, axis=(-2, -1))
        return value

    def residual(self, seen: Seen) -> gauss_newton.Term:
        """c_t - c_t^k: (P, F, 3)."""
        return gauss_newton.Term(seen.com_off_m, self.weight)

    def slope(self, seen: Seen, moves: Moves) -> Array:  # noqa: ARG002
        """Of c: (F, 3, V)."""
        return moves.com


@dataclass(frozen=True, eq=False)
class ComVelocity(LossTerm):
    """How fast the centre of mass c goes, by finite differences (eq. 1, second part)."""

    name = "com_velocity"
    differences = 1

    interval_s: float

    @classmethod
    def of(cls, weight: float, problem: Problem, frames: int) -> Self:  # noqa: ARG003
        """See `LossTerm`."""
        return cls(weight, problem.interval_s)

    def value(self, seen: Seen) -> Array:
        """Σ_t ‖ċ_t - ċ_t^k‖², m²/s²."""
        velocity_off = np.diff(seen.com_off_m, axis=-2) / self.interval_s
        value: Array = np.sum(velocity_off**2, axis=(-2, -1))
        return value

    def residual(self, seen: Seen) -> gauss_newton.Term:
        """ċ_t - ċ_t^k: (P, F - 1, 3)."""
        rate = 1.0 / self.interval_s
        return gauss_newton.Term(rate * np.diff(seen.com_off_m, axis=1), self.weight)

    def slope(self, seen: Seen, moves: Moves) -> Array:  # noqa: ARG002
        """Of c over the time between frames: (F, 3, V)."""
        return moves.com / self.interval_s
