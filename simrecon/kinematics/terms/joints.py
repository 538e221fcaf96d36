"""Terms of the joints' rotation vectors in a frame."""

from __future__ import annotations

import numpy as np

from simrecon.kinematics.gradient import Gradient
from simrecon.kinematics.hessian import Hessian
from simrecon.kinematics.state import State
from simrecon.kinematics.terms.kernels import outside
from simrecon.kinematics.terms.term import Term

SIGMA_LIMIT_RAD = 0.1


class Limit(Term):
    """Joints stay within their range."""

    name = "limit"
    listed = True

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Squared excess."""
        low, high = (state.problem.skeleton.limits_rad[:, None, :, side] for side in (0, 1))
        loss, slope = outside(state.variables.rotvecs[1:], low, high, SIGMA_LIMIT_RAD)
        gradient.rotvecs[1:] += unit * slope
        return unit * loss

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """Of what is beyond."""
        joints = np.swapaxes(state.variables.rotvecs[1:], 0, 1)  # (T, JOINTS, 3)
        low, high = (state.problem.skeleton.limits_rad[..., side] for side in (0, 1))
        beyond = (joints < low) | (joints > high)
        hessian.joints += 2 * weight * beyond / SIGMA_LIMIT_RAD**2


class PosePrior(Term):
    """Poses are such as people take."""

    name = "prior"

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Of the prior of the plan."""
        joints = np.swapaxes(state.variables.rotvecs[1:], 0, 1)  # (T, JOINTS, 3)
        squared, slope = state.problem.observations.prior.squared(joints)
        gradient.rotvecs[1:] += unit * np.swapaxes(slope, 0, 1)
        return unit * float(np.sum(squared))

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:  # noqa: ARG002
        """Of a Gaussian with the spread of the joints, whatever the prior."""
        hessian.prior = max(hessian.prior, weight)
