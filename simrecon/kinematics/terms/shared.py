"""Priors on what all frames share: scale, height of the sole, lengths, and lean of the 3D estimate."""

from __future__ import annotations

import numpy as np

from simrecon.kinematics.gradient import Gradient
from simrecon.kinematics.hessian import Hessian
from simrecon.kinematics.layout import LENGTHS, LOG_SCALE, SOLE
from simrecon.kinematics.state import State
from simrecon.kinematics.terms.term import Term

SOLE_M, SIGMA_SOLE_M = 0.0, 0.015


class _Shared(Term):
    """A prior of the whole clip, with a weight of one."""

    planned = False
    per_frame = False


class Size(_Shared):
    """Stature is as it is known, and the sole at its place."""

    name = "shared"

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Squared deviations; what changes the lengths should leave the stature as it is known."""
        sigma, tallness = state.problem.observations.scale_sigma, state.problem.tallness
        tall = state.variables.log_scale + float(tallness @ state.variables.lengths)
        offset = (state.variables.sole_m - SOLE_M) / SIGMA_SOLE_M
        d_tall = unit * 2 * tall / sigma**2
        gradient.shared[LOG_SCALE] += d_tall
        gradient.shared[SOLE] += unit * 2 * offset / SIGMA_SOLE_M
        gradient.shared[LENGTHS : LENGTHS + len(tallness)] += d_tall * tallness
        return unit * (offset**2 + (tall / sigma) ** 2)

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """Which is exact."""
        sigma = state.problem.observations.scale_sigma
        tall = np.concatenate(([1.0, 0.0], state.problem.tallness))
        hessian.shared[: len(tall), : len(tall)] += weight * 2 * np.outer(tall, tall) / sigma**2
        hessian.shared[SOLE, SOLE] += weight * 2 / SIGMA_SOLE_M**2


class Lengths(_Shared):
    """Lengths are as measured."""

    name = "lengths"

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Squared logarithms."""
        lengths, sigma = state.variables.lengths, state.problem.observations.length_sigma
        gradient.shared[LENGTHS : LENGTHS + len(lengths)] += unit * 2 * lengths / sigma**2
        return unit * float(np.sum(lengths**2)) / sigma**2

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """Which is exact."""
        rows = np.arange(LENGTHS, LENGTHS + len(state.variables.lengths))
        hessian.shared[rows, rows] += weight * 2 / state.problem.observations.length_sigma**2


class Lean(_Shared):
    """The 3D estimate leans by some degrees at most."""

    name = "lean"

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Squared coefficients."""
        lean, sigma = state.variables.lean, state.problem.observations.lean_sigma
        gradient.shared[LENGTHS + len(state.variables.lengths) :] += unit * 2 * lean.ravel() / sigma**2
        return unit * float(np.sum(lean**2)) / sigma**2

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """Which is exact."""
        rows = np.arange(LENGTHS + len(state.variables.lengths), len(hessian.shared))
        hessian.shared[rows, rows] += weight * 2 / state.problem.observations.lean_sigma**2
