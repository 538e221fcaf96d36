"""What a user wishes of the contacts: not in the paper."""

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
class Wished(LossTerm):
    """How far points l are from where a wish has them (`engines.wished`).

    Attributes:
        rows: (K,) points of which anything is wished in the clip.
    """

    name = "wished"

    rows: IntArray

    @classmethod
    def of(cls, weight: float, problem: Problem, frames: int) -> Self:  # noqa: ARG003
        """See `LossTerm`."""
        wished = problem.wished
        return cls(weight, np.flatnonzero(wished.sure.any(axis=0) if wished else []))

    @classmethod
    def applies(cls, problem: Problem) -> bool:
        """Whether anything is wished."""
        return problem.wished is not None

    def value(self, seen: Seen) -> Array:
        """Σ_t Σ_n s_tn ‖l_tn - l^w_tn‖², m², with s 1 where anything is wished of a point."""
        off = self._off(seen)
        value: Array = np.einsum("...fmi,...fmi,fm->...", off, off, self._sure(seen))
        return value

    def residual(self, seen: Seen) -> gauss_newton.Term:
        """l_tn - l^w_tn: (P, F, K, 3)."""
        return gauss_newton.Term(self._off(seen), self.weight * self._sure(seen))

    def slope(self, seen: Seen, moves: Moves) -> Array:  # noqa: ARG002
        """Of l: (F, K, 3, V)."""
        return moves.points[:, self.rows]

    def _off(self, seen: Seen) -> Array:
        wished = seen.targets.wished
        if wished is None:
            return np.zeros((*seen.points_m.shape[:2], len(self.rows), 3))
        return np.asarray(seen.points_m[:, :, self.rows] - wished.points_m[:, self.rows])

    def _sure(self, seen: Seen) -> Array:
        wished = seen.targets.wished
        return np.zeros((len(seen.targets.com_m), 0)) if wished is None else wished.sure[:, self.rows]
