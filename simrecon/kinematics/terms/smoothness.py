"""Terms that tie frames to each other: landmarks and rotation vectors are smooth, and slow feet are still."""

from __future__ import annotations

import numpy as np

from simrecon.kinematics import bands
from simrecon.kinematics.gradient import Gradient
from simrecon.kinematics.hessian import Hessian
from simrecon.kinematics.state import State
from simrecon.kinematics.terms.kernels import acceleration, speeds, still, travel
from simrecon.kinematics.terms.term import Term
from simrecon.types import Array

SIGMA_STILL_MPS = 0.1
SIGMA_SMOOTH_MPS2 = 20.0
SIGMA_SMOOTH_RADPS2 = 100.0


class Still(Term):
    """The ends of the feet are still, unless they are fast."""

    name = "still"
    temporal = True
    listed = True

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Robust speed."""
        loss, slope = still(state.feet_m, state.dt, SIGMA_STILL_MPS)
        gradient.landmarks[state.problem.feet] += unit * slope
        return unit * loss

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """With the mean of the robust weights of a step."""
        step = np.diff(state.feet_m, axis=1) / (state.dt * SIGMA_STILL_MPS)
        slope = (1 / (1 + np.sum(step**2, axis=-1))).mean(axis=0)  # (T - 1,)
        unit = 2 * weight * state.dt / (state.dt * SIGMA_STILL_MPS) ** 2
        hessian.feet.append(bands.first_differences(unit * slope))


class SmoothPosition(Term):
    """Landmarks accelerate little."""

    name = "smooth_position"
    temporal = True
    listed = True

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Squared acceleration."""
        loss, slope = acceleration(state.landmarks_m, state.dt, SIGMA_SMOOTH_MPS2)
        gradient.landmarks += unit * slope
        return unit * loss

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """Without that of the points by the variables."""
        unit = 2 * weight / (state.dt**3 * SIGMA_SMOOTH_MPS2**2)
        hessian.landmarks.append(bands.second_differences(state.problem.frames, unit))


class TravelPosition(Term):
    """Landmarks go no farther than they must (Gärtner 2022, eq. 8, of the mesh)."""

    name = "travel_position"
    temporal = True

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Speed."""
        loss, slope = travel(state.landmarks_m, state.dt)
        gradient.landmarks += unit * slope
        return unit * loss

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """With the speeds of this state."""
        hessian.landmarks.append(_travelled(state.landmarks_m, weight, state.dt))


class SmoothRotation(Term):
    """Joints accelerate little."""

    name = "smooth_rotation"
    temporal = True
    listed = True

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Squared second differences of the rotation vectors."""
        loss, slope = acceleration(state.variables.rotvecs[1:], state.dt, SIGMA_SMOOTH_RADPS2)
        gradient.rotvecs[1:] += unit * slope
        return unit * loss

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """Which is exact."""
        unit = 2 * weight / (state.dt**3 * SIGMA_SMOOTH_RADPS2**2)
        hessian.tie_rotvecs(bands.second_differences(state.problem.frames, unit))


class TravelRotation(Term):
    """Joints turn no farther than they must (Gärtner 2022, eq. 8, of the joints)."""

    name = "travel_rotation"
    temporal = True

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Speed of the rotation vectors."""
        loss, slope = travel(state.variables.rotvecs[1:], state.dt)
        gradient.rotvecs[1:] += unit * slope
        return unit * loss

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """With the speeds of this state."""
        hessian.tie_rotvecs(_travelled(state.variables.rotvecs[1:], weight, state.dt))


def _travelled(values: Array, weight: float, dt: float) -> bands.Bands:
    """Bands of `kernels.travel` of values (M, T, C)."""
    return bands.first_differences(weight / (dt * speeds(values, dt)))
