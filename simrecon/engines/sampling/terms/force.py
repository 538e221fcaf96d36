"""The force of the scene on each foot against that of the plan: not in the paper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from simrecon.engines.problem import FEET, Problem
from simrecon.engines.sampling.terms.moves import Moves
from simrecon.engines.sampling.terms.seen import Seen
from simrecon.engines.sampling.terms.term import LossTerm
from simrecon.metrics.dynamics import GRAVITY_MPS2
from simrecon.optim import gauss_newton
from simrecon.sim.address import locate
from simrecon.types import Array


@dataclass(frozen=True, eq=False)
class Force(LossTerm):
    """What each foot bears, mean since the frame before, in body weights.

    Attributes:
        weight_N: of the person.
    """

    name = "force"

    weight_N: float

    @classmethod
    def of(cls, weight: float, problem: Problem, frames: int) -> Self:  # noqa: ARG003
        """See `LossTerm`."""
        return cls(weight, GRAVITY_MPS2 * locate(problem.model).mass_kg(problem.model))

    @classmethod
    def applies(cls, problem: Problem) -> bool:
        """Whether the planner knows forces."""
        return problem.pushed is not None

    def value(self, seen: Seen) -> Array:
        """Σ_t Σ_n ‖f_tn - f^p_tn‖² over (m g)², of the feet n."""
        value: Array = np.sum(self._off(seen) ** 2, axis=(-3, -2, -1))
        return value

    def residual(self, seen: Seen) -> gauss_newton.Term:
        """f_tn - f^p_tn in body weights: (P, F, 2, 3); zero at the first frame."""
        return gauss_newton.Term(self._off(seen), self.weight)

    def slope(self, seen: Seen, moves: Moves) -> Array:  # noqa: ARG002
        """Of f: (F, 2, 3, V)."""
        return moves.wrenches[:, : len(FEET), 3:] / self.weight_N

    def _off(self, seen: Seen) -> Array:
        planned = seen.targets.wrenches
        if planned is None:
            raise ValueError("force: found no planned wrenches")
        return np.asarray((seen.wrenches[..., : len(FEET), :] - planned)[..., 3:] / self.weight_N)
