"""Joint angles: near the reference, within their ranges, and usual; Gärtner et al. 2022, eq. 2, 4, L_lim."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from simrecon.engines.problem import Problem
from simrecon.engines.sampling.terms.moves import Moves
from simrecon.engines.sampling.terms.seen import Seen
from simrecon.engines.sampling.terms.term import LossTerm
from simrecon.geometry import rotations
from simrecon.optim import gauss_newton
from simrecon.prior import Prior as PosePrior
from simrecon.types import Array, IntArray

LIMIT_SCALE_RAD = 0.1
"""Excess at which the penalty of L_lim is e - 1. The paper says exponential and gives no constant."""
LIMIT_EXCESS_MAX_RAD = 3.0

JOINTS = slice(1, None)
"""All turns but the root's."""


class Pose(LossTerm):
    """How the base and all joints are turned, as quaternions q (eq. 2)."""

    name = "pose"

    def value(self, seen: Seen) -> Array:
        """Σ_t Σ_j arccos |⟨q, q^k⟩|, rad: half of the angles between them."""
        dot = np.abs(np.einsum("...bi,...bi->...b", seen.orientations, seen.targets.orientations))
        value: Array = np.sum(np.arccos(np.minimum(dot, 1.0)), axis=(-2, -1))
        return value

    def residual(self, seen: Seen) -> gauss_newton.Term:
        """Half of the rotation vectors from q^k to q: (P, F, 17, 3)."""
        return gauss_newton.Term(0.5 * self._turn(seen), self.weight, np.ones_like, floor=0.025)

    def slope(self, seen: Seen, moves: Moves) -> Array:
        """Of half the rotation vectors: (F, 17, 3, V)."""
        return moves.of_turns(0.5 * rotations.log_jacobian(self._turn(seen)[0]))

    def _turn(self, seen: Seen) -> Array:
        """Rotation vectors from q^k to q, (P, F, 17, 3)."""
        back = rotations.conjugate(seen.targets.orientations)
        return rotations.log(rotations.multiply(back, seen.orientations))


@dataclass(frozen=True, eq=False)
class JointLimit(LossTerm):
    """How far each component of the joints' rotation vectors is outside its range: L_lim.

    Attributes:
        limits_rad: (16, 3, 2) lowest and highest.
    """

    name = "joint_limit"

    limits_rad: Array

    @classmethod
    def of(cls, weight: float, problem: Problem, frames: int) -> Self:  # noqa: ARG003
        """See `LossTerm`."""
        return cls(weight, problem.limits_rad)

    def value(self, seen: Seen) -> Array:
        """Σ_t Σ exp(excess / scale) - 1 over the components."""
        excess = self._excess(seen)
        value: Array = np.sum(np.expm1(excess / LIMIT_SCALE_RAD), axis=(-3, -2, -1))
        return value

    def residual(self, seen: Seen) -> gauss_newton.Term:
        """The excesses: (P, F, 16, 3, 1)."""
        return gauss_newton.Term(self._excess(seen)[..., None], self.weight, _limit_slope, floor=0.03)

    def slope(self, seen: Seen, moves: Moves) -> Array:
        """Of the excesses: (F, 16, 3, 1, V)."""
        rotvecs = rotations.log(seen.orientations[0, :, 1:])  # (F, 16, 3)
        excess = self._excess(seen)[0]
        outside = (excess > 0) & (excess < LIMIT_EXCESS_MAX_RAD)
        sign = np.where(rotvecs > self.limits_rad[..., 1], 1.0, -1.0) * outside
        by_turn = sign[..., None] * rotations.log_jacobian(rotvecs)
        return moves.of_turns(by_turn, JOINTS)[..., None, :]

    def _excess(self, seen: Seen) -> Array:
        """How far each component is outside its range, (P, F, 16, 3), rad; zero within."""
        rotvecs = rotations.log(seen.orientations[..., 1:, :])
        excess = np.maximum(rotvecs - self.limits_rad[..., 1], self.limits_rad[..., 0] - rotvecs)
        return np.clip(excess, 0.0, LIMIT_EXCESS_MAX_RAD)


def _limit_slope(excess: Array) -> Array:
    """Derivative of the penalty of one component with respect to its excess."""
    slope: Array = np.exp(excess / LIMIT_SCALE_RAD) / LIMIT_SCALE_RAD
    return slope


@dataclass(frozen=True, eq=False)
class Prior(LossTerm):
    """How unusual the poses are, as lengths of latent codes z (eq. 4).

    Attributes:
        prior: gives the codes.
        rows: those of the window's frames that it looks at; share: how many frames each of them stands for.
    """

    name = "prior"

    prior: PosePrior
    rows: IntArray
    share: float

    @classmethod
    def of(cls, weight: float, problem: Problem, frames: int) -> Self:
        """Look at `prior_rate_hz` frames a second, the last one among them."""
        stride = max(1, round(1 / (problem.plan.loss.prior_rate_hz * problem.interval_s)))
        rows = np.arange(frames - 1, -1, -stride)[::-1]
        return cls(weight, problem.prior, rows, frames / len(rows))

    def value(self, seen: Seen) -> Array:
        """Σ_t ‖z(q_t)‖."""
        code = self.prior.latent(seen.orientations[:, self.rows, 1:])
        value: Array = np.sum(np.linalg.norm(code, axis=-1), axis=-1) * self.share
        return value

    def residual(self, seen: Seen) -> gauss_newton.Term:
        """z(q_t), zero at frames that are left out: (P, F, D)."""
        latent = self.prior.latent(seen.orientations[:, self.rows, 1:])
        code = np.zeros((*seen.orientations.shape[:2], latent.shape[-1]))
        code[:, self.rows] = latent
        return gauss_newton.Term(code, self.weight * self.share, np.ones_like)

    def slope(self, seen: Seen, moves: Moves) -> Array:
        """Of the codes, zero at frames that are left out: (F, D, V)."""
        rotvecs = rotations.log(seen.orientations[0, self.rows, 1:])  # (F', 16, 3)
        by_rotvec = self.prior.slope(rotvecs)  # (F', D, 16, 3)
        by_turn = np.einsum("fdji,fjik->fjdk", by_rotvec, rotations.log_jacobian(rotvecs))
        slope = np.zeros((seen.orientations.shape[1], by_rotvec.shape[1], moves.com.shape[-1]))
        slope[self.rows] = moves.of_turns(by_turn, JOINTS).sum(axis=1)
        return slope
