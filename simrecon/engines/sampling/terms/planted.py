"""What stands stays where it is: not in the paper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from simrecon.engines.problem import Problem
from simrecon.engines.sampling.terms.moves import Moves
from simrecon.engines.sampling.terms.seen import Seen
from simrecon.engines.sampling.terms.term import LossTerm
from simrecon.optim import gauss_newton
from simrecon.types import Array, IntArray


@dataclass(frozen=True, eq=False)
class Planted(LossTerm):
    """How fast the points l of feet go that stand, by finite differences.

    Attributes:
        rows: (K,) points of the feet.
        interval_s: between frames.
    """

    name = "planted"
    differences = 1

    rows: IntArray
    interval_s: float

    @classmethod
    def of(cls, weight: float, problem: Problem, frames: int) -> Self:  # noqa: ARG003
        """See `LossTerm`."""
        return cls(weight, np.flatnonzero(problem.planted.any(axis=0)), problem.interval_s)

    def value(self, seen: Seen) -> Array:
        """Σ_t Σ_n p_tn ‖d/dt l_tn‖², m²/s², with p how surely a point stands at both frames."""
        velocity = np.diff(seen.points_m[:, :, self.rows], axis=1) / self.interval_s
        value: Array = np.einsum("...fmi,...fmi,fm->...", velocity, velocity, self._sure(seen))
        return value

    def residual(self, seen: Seen) -> gauss_newton.Term:
        """d/dt l_tn: (P, F - 1, K, 3)."""
        velocity = np.diff(seen.points_m[:, :, self.rows], axis=1) / self.interval_s
        return gauss_newton.Term(velocity, self.weight * self._sure(seen))

    def slope(self, seen: Seen, moves: Moves) -> Array:  # noqa: ARG002
        """Of l over the time between frames: (F, K, 3, V)."""
        return moves.points[:, self.rows] / self.interval_s

    def _sure(self, seen: Seen) -> Array:
        planted = seen.targets.planted[:, self.rows]  # (F, K)
        return np.minimum(planted[1:], planted[:-1])
