"""What the scene does to a body that a user wishes to touch against the plan: not in the papers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from simrecon.engines.problem import Problem
from simrecon.engines.sampling.terms.moves import Moves
from simrecon.engines.sampling.terms.seen import Seen
from simrecon.engines.sampling.terms.term import LossTerm
from simrecon.metrics.dynamics import GRAVITY_MPS2
from simrecon.optim import gauss_newton
from simrecon.sim.address import locate
from simrecon.types import Array, IntArray

LEVER_M = 0.1
"""Moments count as forces at this arm: about half of what lies between two buttocks, or heel and toe."""


@dataclass(frozen=True, eq=False)
class Borne(LossTerm):
    """Force, and moment about where the plan has the scene push, mean since the frame before.

    Places alone do not tell who bears the weight: on two buttocks it rocks from one to the other within a
    tenth of a millimetre.

    Attributes:
        rows: (K,) of the segments among the bodies that are felt.
        weight_N: of the person.
    """

    name = "borne"

    rows: IntArray
    weight_N: float

    @classmethod
    def of(cls, weight: float, problem: Problem, frames: int) -> Self:  # noqa: ARG003
        """See `LossTerm`."""
        own = problem.borne.segments if problem.borne else ()
        rows = np.array([problem.felt.index(segment) for segment in own], np.int64)
        return cls(weight, rows, GRAVITY_MPS2 * locate(problem.model).mass_kg(problem.model))

    @classmethod
    def applies(cls, problem: Problem) -> bool:
        """Whether anything is to touch, and the planner knows forces."""
        return problem.borne is not None

    def value(self, seen: Seen) -> Array:
        """Σ_t Σ_k s_tk (‖f_tk - f^p_tk‖² + ‖m_tk - m^p_tk‖² / l²) over (m g)², of the segments k."""
        off = self._off(seen)
        value: Array = np.einsum("...fki,...fki,fk->...", off, off, self._sure(seen))
        return value

    def residual(self, seen: Seen) -> gauss_newton.Term:
        """Moments over the lever, and forces, in body weights: (P, F, K, 6)."""
        return gauss_newton.Term(self._off(seen), self.weight * self._sure(seen))

    def slope(self, seen: Seen, moves: Moves) -> Array:
        """Of those: (F, K, 6, V)."""
        return self._scaled(seen) @ moves.wrenches[:, self.rows]

    def _off(self, seen: Seen) -> Array:
        borne = seen.targets.borne
        if borne is None:
            return np.zeros((*seen.points_m.shape[:2], len(self.rows), 6))
        off = seen.wrenches[:, :, self.rows] - borne.wrenches
        return np.asarray((self._scaled(seen) @ off[..., None])[..., 0])

    def _scaled(self, seen: Seen) -> Array:
        """Matrices (F, K, 6, 6) by which wrenches about the origin become those about the places."""
        borne = seen.targets.borne
        if borne is None:
            return np.zeros((len(seen.targets.com_m), len(self.rows), 6, 6))
        matrix = np.zeros((*borne.places_m.shape[:2], 6, 6))
        matrix[..., range(3), range(3)] = 1.0 / LEVER_M
        matrix[..., range(3, 6), range(3, 6)] = 1.0
        matrix[..., :3, 3:] = -np.cross(borne.places_m[..., None, :], np.eye(3)).swapaxes(-1, -2) / LEVER_M
        return matrix / self.weight_N

    def _sure(self, seen: Seen) -> Array:
        borne = seen.targets.borne
        return np.zeros((len(seen.targets.com_m), len(self.rows))) if borne is None else borne.sure
