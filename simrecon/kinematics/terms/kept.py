"""Terms of a motion on another body: what touched still does, what rested rests, joints keep their angles."""

from __future__ import annotations

import numpy as np

from simrecon import scene as scenes
from simrecon.kinematics.gradient import Gradient
from simrecon.kinematics.hessian import Hessian
from simrecon.kinematics.state import State
from simrecon.kinematics.terms.kernels import held, near
from simrecon.kinematics.terms.term import Term
from simrecon.types import Array

# What touched keeps its distance, what was held stays: firmly, against landmarks with a scale of 10 cm.
SIGMA_CLEARANCE_M, SIGMA_HELD_MPS = 0.005, 0.05
# Landmarks say little of how a straight limb is twisted: joints stay near their angles.
SIGMA_TURN_RAD = 0.5


class _Kept(Term):
    """A term without a weight in the plan, and that the search can do without a curvature of."""

    planned = False

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """Left out."""


class Touch(_Kept):
    """What touched is as near as it was (Rempe 2020, eq. B7)."""

    name = "touch"

    def __init__(self, clearance_m: Array, touching: Array) -> None:
        """Distances (S, G, T) to keep, over the ground and all items, and how surely each was a contact."""
        self.clearance_m, self.touching = clearance_m, touching

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Squared difference of the clearances."""
        apart, normals = scenes.distances(state.problem.scene, state.spheres_m)
        clearance = apart - state.problem.contacts.radii_m[:, None]
        loss, slope = near(clearance, self.clearance_m, self.touching, SIGMA_CLEARANCE_M)
        gradient.spheres += unit * np.einsum("sgt,sgti->gti", slope, normals)
        return unit * loss


class Hold(_Kept):
    """What rested on something rests (Rempe 2020, eq. B6)."""

    name = "hold"

    def __init__(self, resting: Array) -> None:
        """How surely a contact point rests from a frame to the next, (G, T - 1)."""
        self.resting = resting

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Squared speed."""
        loss, slope = held(state.spheres_m, self.resting, state.dt, SIGMA_HELD_MPS)
        gradient.spheres += unit * slope
        return unit * loss


class Turn(_Kept):
    """Joints keep their angles."""

    name = "turn"

    def __init__(self, rotvecs: Array) -> None:
        """Rotation vectors (SEGMENTS, T, 3) of the motion before."""
        self.rotvecs = rotvecs

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Squared difference of the rotation vectors."""
        loss, slope = near(state.variables.rotvecs, self.rotvecs, 1.0, SIGMA_TURN_RAD)
        gradient.rotvecs += unit * slope
        return unit * loss
