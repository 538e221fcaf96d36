"""Terms of the loss of a rollout: one class each, in the order in which their values are summed.

A new term is a class here, a weight of the same name in `plan.LossWeights`, and a test.
"""

from __future__ import annotations

from simrecon.engines.problem import Problem
from simrecon.engines.sampling.terms.borne import Borne
from simrecon.engines.sampling.terms.centre import ComPosition, ComVelocity
from simrecon.engines.sampling.terms.force import Force, Moment
from simrecon.engines.sampling.terms.landmarks import (
    Landmark,
    LandmarkVelocity,
    Reprojection,
    TotalVariation,
)
from simrecon.engines.sampling.terms.moves import Moves
from simrecon.engines.sampling.terms.planted import Planted
from simrecon.engines.sampling.terms.pose import JointLimit, Pose, Prior
from simrecon.engines.sampling.terms.seen import Seen, Targets
from simrecon.engines.sampling.terms.term import LossTerm
from simrecon.engines.sampling.terms.wished import Wished
from simrecon.errors import InputError

__all__ = ["DIFFERENCES", "TERMS", "LossTerm", "Moves", "Seen", "Targets", "of_window"]

TERMS: tuple[type[LossTerm], ...] = (
    ComPosition,
    ComVelocity,
    Pose,
    Landmark,
    LandmarkVelocity,
    Planted,
    Wished,
    Borne,
    Force,
    Moment,
    Reprojection,
    JointLimit,
    Prior,
    TotalVariation,
)

DIFFERENCES = max(term.differences for term in TERMS)
"""Frames before its own that a frame of the loss looks at, at most."""


def of_window(problem: Problem, frames: int) -> tuple[LossTerm, ...]:
    """The terms that the plan switches on and the clip allows, in a window with so many frames of the loss.

    Raises:
        InputError: there are none.
    """
    terms = []
    for term in TERMS:
        weight = getattr(problem.plan.loss, term.name)
        if weight and term.applies(problem):
            terms.append(term.of(weight, problem, frames))
    if not terms:
        valid = ", ".join(term.name for term in TERMS)
        raise InputError(f"[loss] of the plan has no weight above 0 that this clip can use; valid: {valid}")
    return tuple(terms)
