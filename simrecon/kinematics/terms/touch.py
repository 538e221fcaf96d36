"""Terms of floor and items: nothing goes into them, and what rests on them does so."""

from __future__ import annotations

import numpy as np

from simrecon.kinematics.contacts import pulls
from simrecon.kinematics.gradient import Gradient
from simrecon.kinematics.hessian import Hessian
from simrecon.kinematics.state import State
from simrecon.kinematics.terms.term import Term
from simrecon.types import Array

SIGMA_PENETRATION_M = 0.01


class Penetration(Term):
    """Nothing of the person is within floor or items."""

    name = "penetration"
    needs_floor = True
    listed = True

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Squared depth."""
        loss, slope = penetration(state.clearance_m, SIGMA_PENETRATION_M)
        gradient.clearances += slope * unit
        return unit * loss

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """Of what is inside."""
        least, _ = state.nearest
        hessian.nearest += np.where(least < 0, weight / SIGMA_PENETRATION_M**2, 0.0)


class Contact(Term):
    """What rests on a support touches it (`contacts.pulls`)."""

    name = "contact"
    needs_floor = True
    listed = True

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Distance from the support, whose pull fades."""
        see, clearance, total = state.problem.observations, state.clearance_m, 0.0
        for pull in pulls(state.problem.contacts, see.labels, clearance, see.targets):
            loss, slope = touching(clearance[pull.at] + pull.depth_m, pull.sigma, pull.weights)
            gradient.clearances[pull.at] += unit * slope
            total += unit * loss
        return total

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """Of the pulls, as if each were to the nearest support."""
        see, (least, _) = state.problem.observations, state.nearest
        for pull in pulls(state.problem.contacts, see.labels, state.clearance_m, see.targets):
            far = (least[pull.at[1:]] + pull.depth_m) / pull.sigma
            hessian.nearest[pull.at[1:]] += weight * pull.weights / (pull.sigma**2 * (1 + far**2) ** 2)


def penetration(clearance_m: Array, sigma: float) -> tuple[float, Array]:
    """Squared depth inside of floor or items; clearances of any shape, negative inside."""
    depth = np.maximum(-clearance_m, 0.0) / sigma
    return float(np.sum(depth**2)), -2 * depth / sigma


def touching(clearance_m: Array, sigma: float, weights: Array | float = 1.0) -> tuple[float, Array]:
    """Pull of points to their support, fading with distance (in the manner of Gärtner 2022 eq. 6).

    Args:
        clearance_m: signed distances, any shape.
        sigma: distance at which the pull begins to fade.
        weights: of the same shape, or one for all.
    """
    squared = (clearance_m / sigma) ** 2
    loss = float(np.sum(weights * squared / (1 + squared)))
    return loss, weights * 2 * clearance_m / sigma**2 / (1 + squared) ** 2
