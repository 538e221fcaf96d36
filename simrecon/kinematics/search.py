"""The search of the kinematic fit: L-BFGS in variables of like weight, chosen anew as curvature changes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Protocol

import numpy as np

from simrecon.kinematics import conditioning
from simrecon.kinematics.hessian import Curvature
from simrecon.kinematics.layout import Variables
from simrecon.optim import lbfgs
from simrecon.types import Array

# The curvature is taken anew after so many evaluations.
ROUND, FTOL_REL = 25, 1e-5


class Conditioning(Protocol):
    """A change of variables: from well-scaled ones u (n',), which are searched, to the packed x (n,)."""

    @property
    def free(self) -> int:
        """Number of the u that are of single frames; those after them are shared by all."""

    def to_variables(self, u: Array) -> Array:
        """X of u."""

    def from_variables(self, x: Array) -> Array:
        """U of x."""

    def gradient(self, g: Array) -> Array:
        """By u, of a gradient by x."""


def _by_frame(parts: Iterable[Curvature], _start: Variables) -> Conditioning:
    """All unknowns of all frames."""
    return conditioning.condition(parts)


def minimise(
    objective: Callable[[Array], tuple[float, Array]],
    curvature: Callable[[Variables], Iterable[Curvature]],
    start: Variables,
    evaluations: int,
    *,
    settled: float = 2e-3,
    shared: bool = True,
    condition: Callable[[Iterable[Curvature], Variables], Conditioning] = _by_frame,
    anew: int = ROUND,
    history: int = lbfgs.MEMORY,
) -> tuple[Variables, int]:
    """Minimise an objective of the packed variables.

    Args:
        objective: loss and gradient (n,) at packed variables (n,).
        curvature: of the objective at variables, one block of frames after the other.
        start: where to begin; without evaluations it is the end, too.
        evaluations: most of them.
        settled: the search ends when a round lowers the loss by less than this share.
        shared: whether what all frames share (scale, sole, lengths, lean) may move.
        condition: the variables to search in, by a curvature and where it is taken.
        anew: evaluations after which the curvature is taken anew.
        history: steps of the search that approximate what the curvature lacks.

    Returns:
        The best variables, and the evaluations that were used.
    """
    variables, used, loss = start, 0, np.inf
    while used < evaluations:
        most = min(anew, evaluations - used)
        # no name holds the last curvature's variables while the next ones are made
        variables, step = _round(
            objective, condition(curvature(variables), variables), variables, most, history, shared=shared
        )
        used += step.evaluations
        if loss - step.loss < settled * step.loss:
            break
        loss = step.loss
    return variables, used


def _round(
    objective: Callable[[Array], tuple[float, Array]],
    better: Conditioning,
    start: Variables,
    evaluations: int,
    history: int,
    *,
    shared: bool,
) -> tuple[Variables, lbfgs.Minimum]:
    """Search in the variables of one curvature, which is let go of before the next is taken."""

    def scaled(u: Array, unit: float = 1.0) -> tuple[float, Array]:
        # a line search may try lengths of astronomical units, which count as far worse
        with np.errstate(over="ignore", invalid="ignore"):
            value, slope = objective(better.to_variables(unit * u))
        gradient = unit * better.gradient(slope)
        if not shared:
            gradient[better.free :] = 0.0
        return value, gradient

    # the search's first step is one long: the unit is that of Newton's step
    began = better.from_variables(start.pack())
    unit = float(np.linalg.norm(scaled(began)[1])) or 1.0
    step = lbfgs.minimize(
        partial(scaled, unit=unit),
        began / unit,
        max_evaluations=evaluations,
        ftol_rel=FTOL_REL,
        memory=history,
    )
    x = better.to_variables(unit * step.x)
    return Variables.unpack(x, len(start.root_m), len(start.lengths)), step
