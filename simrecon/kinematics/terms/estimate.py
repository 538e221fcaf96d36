"""Terms of the 3D estimate."""

from __future__ import annotations

import numpy as np

from simrecon.geometry import rotations
from simrecon.kinematics.gradient import Gradient
from simrecon.kinematics.hessian import Hessian, gram
from simrecon.kinematics.layout import FREE
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.state import State
from simrecon.kinematics.terms.kernels import distance
from simrecon.kinematics.terms.term import Term


class _OfEstimate(Term):
    """A term that needs a 3D estimate."""

    listed = True

    def applies(self, problem: Problem) -> bool:
        """With a 3D estimate in some frame only."""
        return bool(problem.observations.joint_weights.any())


class Joint(_OfEstimate):
    """Landmarks are relative to the hips where the 3D estimate has them, but for its lean."""

    name = "joint"

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Robust distance."""
        see, sigma = state.problem.observations, state.problem.plan.joint_scale_m
        relative = state.landmarks_m - state.hips_m
        loss, slope = distance(relative, state.targets_m, see.joint_weights, sigma)
        slope *= unit
        gradient.landmarks += slope - see.root_weights[:, None, None] * slope.sum(axis=0)
        gradient.targets -= slope
        return unit * loss

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """With the robust weights of this state."""
        see, sigma, wide = state.problem.observations, state.problem.plan.joint_scale_m, hessian.jacobian.wide
        targets = np.swapaxes(state.targets_m, 0, 1)  # (T, M, 3)
        off = (state.landmarks_m - state.hips_m - state.targets_m) / sigma
        slope = 1 / (1 + np.sum(off**2, axis=-1))
        each = 2 * weight * state.dt * see.joint_weights * slope / sigma**2  # (M, T)
        relative = wide - hessian.jacobian.hips[:, None]
        if not see.metric:
            relative[..., FREE] -= targets
        # a target turned by dρ moves by (J dρ) × q, so the residual by [q]ₓ J dρ
        lean = rotations.skew(targets) @ rotations.left_jacobian(state.lean_rad)[:, None]  # (T, M, 3, 3)
        hessian.frames += gram(np.concatenate((relative, lean), axis=-1), each.T[..., None, None] * np.eye(3))


class Place(_OfEstimate):
    """The hips are where the 3D estimate puts them."""

    name = "place"

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Robust distance."""
        see, sigma = state.problem.observations, state.problem.plan.place_scale_m
        loss, slope = distance(state.hips_m, see.place_m, see.place_weights, sigma)
        gradient.landmarks += unit * see.root_weights[:, None, None] * slope
        return unit * loss

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """As if it were a plain square."""
        sigma, hips = state.problem.plan.place_scale_m, hessian.jacobian.hips
        held = 2 * weight * state.dt * state.problem.observations.place_weights / sigma**2
        hessian.plain += held[:, None, None] * np.swapaxes(hips, -1, -2) @ hips
