"""What the scene does to each foot against what the plan has it do, force and moment: not in the paper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from simrecon.body import names
from simrecon.contact.parts import SIDES
from simrecon.engines.problem import FEET, Problem
from simrecon.engines.sampling.terms.moves import Moves
from simrecon.engines.sampling.terms.seen import Seen
from simrecon.engines.sampling.terms.term import LossTerm
from simrecon.metrics.dynamics import GRAVITY_MPS2
from simrecon.optim import gauss_newton
from simrecon.sim.address import locate
from simrecon.types import Array, IntArray


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
        return cls(weight, _weight_N(problem))

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
        return np.asarray(_off(seen)[..., 3:] / self.weight_N)


@dataclass(frozen=True, eq=False)
class Moment(LossTerm):
    """The moment on each foot about its middle, mean since the frame before: where it bears what it bears.

    The middle c is that of heel and toe in the reference, so that it does not move with the simulation.

    Attributes:
        unit_Nm: weight of the person times the length of a foot.
        ends: (2, 2) points of heel and toe of each foot.
    """

    name = "moment"

    unit_Nm: float
    ends: IntArray

    @classmethod
    def of(cls, weight: float, problem: Problem, frames: int) -> Self:  # noqa: ARG003
        """See `LossTerm`."""
        rows = [str(point["name"]) for point in names.points()]
        ends = np.array([[rows.index(f"{side}_{end}") for end in ("heel", "toe")] for side in SIDES])
        heel, toe = problem.points_m[0, ends[0]]
        return cls(weight, _weight_N(problem) * float(np.linalg.norm(toe - heel)), ends)

    @classmethod
    def applies(cls, problem: Problem) -> bool:
        """Whether the planner knows forces."""
        return Force.applies(problem)

    def value(self, seen: Seen) -> Array:
        """Σ_t Σ_n ‖m_tn - m^p_tn - c_tn × (f_tn - f^p_tn)‖² over (m g l)², l the length of a foot."""
        value: Array = np.sum(self._off(seen) ** 2, axis=(-3, -2, -1))
        return value

    def residual(self, seen: Seen) -> gauss_newton.Term:
        """The moments' differences about c in units of m g l: (P, F, 2, 3); zero at the first frame."""
        return gauss_newton.Term(self._off(seen), self.weight)

    def slope(self, seen: Seen, moves: Moves) -> Array:
        """Of m - c × f: (F, 2, 3, V)."""
        feet = moves.wrenches[:, : len(FEET)]
        moment, force = feet[..., :3, :], feet[..., 3:, :]
        turned = np.cross(self._middles(seen)[..., None], force, axis=-2)
        return np.asarray((moment - turned) / self.unit_Nm)

    def _off(self, seen: Seen) -> Array:
        off = _off(seen)
        return np.asarray((off[..., :3] - np.cross(self._middles(seen), off[..., 3:])) / self.unit_Nm)

    def _middles(self, seen: Seen) -> Array:
        """c, (F, 2, 3)."""
        return np.asarray(seen.targets.points_m[:, self.ends].mean(axis=-2))


def _weight_N(problem: Problem) -> float:
    return GRAVITY_MPS2 * locate(problem.model).mass_kg(problem.model)


def _off(seen: Seen) -> Array:
    """Wrenches on the feet less those planned, (P, F, 2, 6)."""
    planned = seen.targets.wrenches
    if planned is None:
        raise ValueError("force: found no planned wrenches")
    return np.asarray(seen.wrenches[..., : len(FEET), :] - planned)
