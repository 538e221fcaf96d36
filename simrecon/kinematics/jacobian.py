"""Derivatives of a person's points by the unknowns of their frame, and by those that all frames share."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from simrecon.kinematics import forward, layout
from simrecon.kinematics.state import State
from simrecon.types import Array, IntArray, Skeleton


class Jacobian:
    """Derivatives of the points of a state; each is computed when it is first needed."""

    def __init__(self, state: State) -> None:
        self._state = state

    @cached_property
    def landmarks(self) -> Array:
        """By the unknowns of their frame, (T, M, 3, FREE)."""
        state, skeleton = self._state, self._state.problem.skeleton
        return of_points(skeleton, state.pose, skeleton.point_segments, state.landmarks_m)

    @cached_property
    def feet(self) -> Array:
        """Of the landmarks at the ends of the feet, (T, 4, 3, FREE)."""
        feet: Array = self.landmarks[:, self._state.problem.feet]
        return feet

    @cached_property
    def wide(self) -> Array:
        """Of the landmarks by the unknowns of their frame, log scale, sole and lengths, (T, M, 3, …)."""
        state, skeleton = self._state, self._state.problem.skeleton
        shared = of_shared(state, skeleton.point_segments, state.landmarks_m, state.problem.drop)
        return np.concatenate((self.landmarks, shared), axis=-1)

    @cached_property
    def hips(self) -> Array:
        """Of what the root of the 3D estimate is, by the same, (T, 3, …)."""
        weights = self._state.problem.observations.root_weights
        return np.asarray(np.einsum("m,tmij->tij", weights, self.wide))

    @cached_property
    def spheres(self) -> Array:
        """By the unknowns of their frame, (T, G, 3, FREE)."""
        state = self._state
        return of_points(state.problem.skeleton, state.pose, state.problem.contacts.segments, state.spheres_m)

    @cached_property
    def com(self) -> Array:
        """Of the centre of mass, (T, 1, 3, FREE)."""
        share = self._state.problem.contacts.mass_share
        return np.asarray(np.einsum("g,tgij->tij", share, self.spheres)[:, None])


def of_points(skeleton: Skeleton, pose: forward.Pose, segments: IntArray, points_m: Array) -> Array:
    """Derivative of points (P, T, 3) on segments (P,) by the unknowns of their frame, (T, P, 3, FREE)."""
    count, frames = pose.origins_m.shape[:2]
    moved = np.zeros((frames, len(segments), layout.AXES, layout.FREE))
    moved[..., : layout.AXES] = np.eye(layout.AXES)
    turning = pose.before @ pose.jacobians  # (SEGMENTS, T, 3, 3) columns are axes in the world
    below = moved_by(skeleton)
    for b in range(count):
        rows = np.flatnonzero(below[b, segments])
        lever = points_m[rows] - pose.origins_m[b]  # (P', T, 3)
        for axis in range(layout.AXES):
            turn = forward.cross(turning[b, :, :, axis][None], lever)
            moved[:, rows, :, layout.turn(b, axis)] = turn  # indices apart: the rows come first
    return moved


def moved_by(skeleton: Skeleton) -> Array:
    """Which segments a joint moves, (SEGMENTS, SEGMENTS)."""
    count = len(skeleton.names)
    below = np.zeros((count, count), bool)
    for segment in range(count):
        joint = segment
        while joint >= 0:
            below[joint, segment] = True
            joint = int(skeleton.parents[joint])
    return below


def of_shared(state: State, segments: IntArray, points_m: Array, drop: Array) -> Array:
    """Derivative of points by log scale, sole and lengths, (T, M, 3, 2 + L).

    Args:
        state: whose pose they are of.
        segments: (M,) of the points.
        points_m: (M, T, 3).
        drop: (M, 3) how each moves as the sole goes down by a metre.
    """
    problem, variables, pose = state.problem, state.variables, state.pose
    skeleton = problem.skeleton
    down = (pose.axes[segments] @ drop[:, None, :, None])[..., 0]  # (M, T, 3)
    grown = points_m - variables.root_m - variables.sole_m * down
    longer = state.scale * np.exp(variables.lengths)[:, None, None] * problem.stretch[:, 1:]  # (L, JOINTS, 3)
    shift = np.einsum("btij,lbj->lbti", pose.axes[skeleton.parents[1:]], longer)  # (L, JOINTS, T, 3)
    lengths = np.einsum("bm,lbti->lmti", moved_by(skeleton)[1:, segments].astype(float), shift)
    return np.moveaxis(np.concatenate((grown[None], down[None], lengths)), (0, 2), (3, 0))
