"""Gradient of a sum of terms, each of which adds its derivatives by the quantities of a state."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from simrecon.geometry import rotations
from simrecon.kinematics import forward, layout
from simrecon.kinematics.state import State
from simrecon.types import Array, IntArray


class Gradient:
    """Sum of the derivatives of terms by the quantities of a state.

    Attributes:
        landmarks: (M, T, 3); spheres: (G, T, 3); com: (T, 3) by these positions.
        targets: (M, T, 3) by those of the 3D estimate; clearances: (S, G, T).
        rotvecs: (SEGMENTS, T, 3) by the rotation vectors themselves.
        shared: (m,) by what all frames share, itself.
    """

    def __init__(self, state: State) -> None:
        self.state = state
        self.landmarks, self.spheres = np.zeros_like(state.landmarks_m), np.zeros_like(state.spheres_m)
        self.com = np.zeros_like(state.variables.root_m)
        self.rotvecs = np.zeros_like(state.variables.rotvecs)
        lengths = len(state.variables.lengths)
        self.shared = np.zeros(layout.LENGTHS + lengths + state.variables.lean.size)

    @cached_property
    def targets(self) -> Array:
        """Zero, and computed only where a term adds to it."""
        return np.zeros_like(self.state.targets_m)

    @cached_property
    def clearances(self) -> Array:
        """Zero, and computed only where a term adds to it."""
        return np.zeros_like(self.state.clearance_m)

    def _used(self, name: str) -> bool:
        """Whether a term has added to it."""
        return name in self.__dict__

    def packed(self) -> Array:
        """By the packed variables, (n,)."""
        state, problem = self.state, self.state.problem
        d_lean, by_targets = self._of_targets()
        spheres, by_radii = self._of_spheres()
        points = np.concatenate((state.landmarks_m, state.spheres_m))  # (M + G, T, 3)
        by_points = np.concatenate((self.landmarks, spheres))
        segments = np.concatenate((problem.skeleton.point_segments, problem.contacts.segments))
        force, d_rotvecs = forward.adjoint(problem.skeleton, state.pose, segments, points, by_points)
        # all lengths grow with exp(log_scale), so a point moves by its distance from the root
        by_size = float(np.sum(by_points * (points - state.variables.root_m)))
        drop = np.concatenate((problem.drop, problem.contacts.drop))  # (M + G, 3)
        d_sole = of_sole(state, segments, drop, by_points)
        # the sole's height does not grow with the scale
        d_scale = by_targets + (by_radii + by_size) - state.variables.sole_m * d_sole
        ends = np.concatenate(([d_scale, d_sole], of_lengths(state, force), d_lean.ravel())) + self.shared
        return layout.join(force[0], d_rotvecs + self.rotvecs, ends)

    def _of_targets(self) -> tuple[Array, float]:
        """By the lean (F, 3), and by log scale as far as the 3D estimate grows with it."""
        state = self.state
        if not self._used("targets"):
            return np.zeros_like(state.variables.lean), 0.0
        moment = forward.cross(state.targets_m, self.targets).sum(axis=0)  # (T, 3)
        turn = rotations.left_jacobian(state.lean_rad).swapaxes(-1, -2) @ moment[..., None]
        grown = 0.0 if state.problem.observations.metric else float(np.sum(self.targets * state.targets_m))
        return state.problem.leans.T @ turn[..., 0], grown

    def _of_spheres(self) -> tuple[Array, float]:
        """By the spheres (G, T, 3), and by log scale as far as their radii grow with it."""
        state, touch = self.state, self.state.problem.contacts
        spheres = self.spheres + touch.mass_share[:, None, None] * self.com
        if not self._used("clearances"):
            return spheres, 0.0
        pushed = np.einsum("sgt,sgti->gti", self.clearances, state.normals)
        by_radii = -float(np.sum(self.clearances.sum(axis=0) * state.scale * touch.radii_m[:, None]))
        return pushed + spheres, by_radii


def of_sole(state: State, segments: IntArray, drop: Array, by_points: Array) -> float:
    """By the height of the sole, from the gradient of points.

    Args:
        state: whose pose they are of.
        segments: (P,) of the points.
        drop: (P, 3) how each moves as the sole goes down by a metre.
        by_points: (P, T, 3).
    """
    low = np.flatnonzero(drop.any(axis=1))
    down = (state.pose.axes[segments[low]] @ drop[low, None, :, None])[..., 0]  # (low, T, 3)
    return float(np.sum(by_points[low] * down))


def of_lengths(state: State, force: Array) -> Array:
    """By the lengths (L,): all below a joint moves with its offset; force (SEGMENTS, T, 3) on it."""
    problem = state.problem
    parents = problem.skeleton.parents[1:]
    local = np.einsum("btji,btj->bi", state.pose.axes[parents], force[1:])  # (JOINTS, 3) Σ_t R_parentᵀ f
    along = np.einsum("lbi,bi->l", problem.stretch[:, 1:], local)
    return np.asarray(state.scale * np.exp(state.variables.lengths) * along)
