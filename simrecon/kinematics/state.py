"""Where a problem's variables put the person: the quantities that terms are functions of."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from simrecon import scene as scenes
from simrecon.kinematics import forward
from simrecon.kinematics.layout import Variables
from simrecon.kinematics.problem import Problem
from simrecon.types import Array

FAR_M = 10.0  # in place of the infinite distance of items out of reach


class State:
    """A problem at its variables; each quantity is computed when it is first needed.

    Attributes:
        problem: and variables: at which it is taken.
        scale: of the skeleton; pose: of its segments.
    """

    def __init__(self, problem: Problem, variables: Variables) -> None:
        self.problem, self.variables = problem, variables
        self.scale = float(np.exp(variables.log_scale))
        person = problem.person(variables)
        self.pose = forward.forward(person, variables.root_m, problem.base, variables.rotvecs, self.scale)

    @property
    def dt(self) -> float:
        """Time from a frame to the next, s."""
        return self.problem.dt

    @cached_property
    def landmarks_m(self) -> Array:
        """Landmarks of the person, (M, T, 3)."""
        skeleton = self.problem.skeleton
        offsets = self.scale * skeleton.point_offsets_m + self.variables.sole_m * self.problem.drop
        return forward.points(self.pose, skeleton.point_segments, offsets)

    @cached_property
    def feet_m(self) -> Array:
        """Those at the ends of the feet, (4, T, 3)."""
        feet: Array = self.landmarks_m[self.problem.feet]
        return feet

    @cached_property
    def hips_m(self) -> Array:
        """What the root of the 3D estimate is of the person, (T, 3)."""
        return np.tensordot(self.problem.observations.root_weights, self.landmarks_m, axes=1)

    @cached_property
    def lean_rad(self) -> Array:
        """Rotation vectors by which the 3D estimate is turned, (T, 3)."""
        return self.problem.leans @ self.variables.lean

    @cached_property
    def targets_m(self) -> Array:
        """The 3D estimate, turned by the lean, at the size of the person, relative to its root, (M, T, 3)."""
        see = self.problem.observations
        return (1.0 if see.metric else self.scale) * forward.turned(self.lean_rad, see.joints_m)

    @cached_property
    def spheres_m(self) -> Array:
        """Centres of the spheres that may touch the scene, (G, T, 3)."""
        touch = self.problem.contacts
        offsets = self.scale * touch.offsets_m + self.variables.sole_m * touch.drop
        return forward.points(self.pose, touch.segments, offsets)

    @cached_property
    def _apart(self) -> tuple[Array, Array]:
        apart, normals = scenes.nearby(self.problem.scene, self.spheres_m)
        return np.minimum(apart, FAR_M) - self.scale * self.problem.contacts.radii_m[:, None], normals

    @property
    def clearance_m(self) -> Array:
        """Distances of the spheres from the ground and the items near them, (S, G, T), negative inside."""
        return self._apart[0]

    @property
    def normals(self) -> Array:
        """Gradient of the clearances by the centres, (S, G, T, 3)."""
        return self._apart[1]

    @cached_property
    def nearest(self) -> tuple[Array, Array]:
        """The least clearance of each sphere (G, T), and its gradient (G, T, 3)."""
        support = np.argmin(self.clearance_m, axis=0)[None]  # (1, G, T)
        least = np.take_along_axis(self.clearance_m, support, axis=0)[0]
        return least, np.take_along_axis(self.normals, support[..., None], axis=0)[0]

    @cached_property
    def com_m(self) -> Array:
        """Centre of mass, (T, 3)."""
        return np.tensordot(self.problem.contacts.mass_share, self.spheres_m, axes=1)

    @cached_property
    def soles_m(self) -> Array:
        """Middle of the left and of the right sole, (2, T, 3)."""
        return np.asarray(self.spheres_m[self.problem.contacts.soles].mean(axis=1))
