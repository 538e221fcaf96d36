"""Points of the body: near those of the reference, near those of the image, and without jerks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from simrecon.engines.problem import Problem
from simrecon.engines.sampling.terms.moves import Moves
from simrecon.engines.sampling.terms.seen import Seen
from simrecon.engines.sampling.terms.term import LossTerm
from simrecon.optim import gauss_newton
from simrecon.types import Array, IntArray

NEAREST_M = 0.1
"""Depth that a point counts with at least, before the camera."""


@dataclass(frozen=True, eq=False)
class Landmark(LossTerm):
    """Where the points l are; not in the paper.

    Attributes:
        weights: (M,) of the points.
    """

    name = "landmark"

    weights: Array

    @classmethod
    def of(cls, weight: float, problem: Problem, frames: int) -> Self:  # noqa: ARG003
        """See `LossTerm`."""
        return cls(weight, problem.point_weights)

    def value(self, seen: Seen) -> Array:
        """Σ_t Σ_n w_n ‖l_tn - l^k_tn‖², m²."""
        return _weighted_squares(seen.points_off_m, self.weights)

    def residual(self, seen: Seen) -> gauss_newton.Term:
        """l_tn - l^k_tn: (P, F, M, 3)."""
        return gauss_newton.Term(seen.points_off_m, self.weight * self.weights)

    def slope(self, seen: Seen, moves: Moves) -> Array:  # noqa: ARG002
        """Of l: (F, M, 3, V)."""
        return moves.points


@dataclass(frozen=True, eq=False)
class LandmarkVelocity(LossTerm):
    """How fast the points l go, by finite differences; not in the paper.

    Attributes:
        weights: (M,) of the points.
        interval_s: between frames.
    """

    name = "landmark_velocity"
    differences = 1

    weights: Array
    interval_s: float

    @classmethod
    def of(cls, weight: float, problem: Problem, frames: int) -> Self:  # noqa: ARG003
        """See `LossTerm`."""
        return cls(weight, problem.point_weights, problem.interval_s)

    def value(self, seen: Seen) -> Array:
        """Σ_t Σ_n w_n ‖d/dt (l_tn - l^k_tn)‖², m²/s²."""
        off = np.diff(seen.points_m, axis=-3) - np.diff(seen.targets.points_m, axis=-3)
        return _weighted_squares(off, self.weights / self.interval_s**2)

    def residual(self, seen: Seen) -> gauss_newton.Term:
        """d/dt (l_tn - l^k_tn): (P, F - 1, M, 3)."""
        rate = 1.0 / self.interval_s
        return gauss_newton.Term(rate * np.diff(seen.points_off_m, axis=1), self.weight * self.weights)

    def slope(self, seen: Seen, moves: Moves) -> Array:  # noqa: ARG002
        """Of l over the time between frames: (F, M, 3, V)."""
        return moves.points / self.interval_s


class Reprojection(LossTerm):
    """Where the points l are in the ideal image plane of the camera C, against the detections l^d (eq. 3).

    The paper leaves the unit of the image open; here it is the focal length, and detections are undistorted.
    """

    name = "reprojection"
    needs_camera = True

    def value(self, seen: Seen) -> Array:
        """Σ_t Σ_n s_tn ‖C l_tn - l^d_tn‖ with the scores s of the detections."""
        distance = np.sqrt(np.sum(_image_off(seen) ** 2, axis=-1))
        value: Array = np.sum(seen.targets.scores * distance, axis=(-2, -1))
        return value

    def residual(self, seen: Seen) -> gauss_newton.Term:
        """C l_tn - l^d_tn: (P, F, M, 2)."""
        weights = self.weight * seen.targets.scores
        return gauss_newton.Term(_image_off(seen), weights, np.ones_like, floor=0.005)

    def slope(self, seen: Seen, moves: Moves) -> Array:
        """Of C l: (F, M, 2, V); zero in depth where a point is not in front."""
        rotation, _, xyz = _in_camera(seen)
        x, y, z = np.moveaxis(xyz[0], -1, 0)  # (F, M)
        depth, ahead = np.maximum(z, NEAREST_M), z > NEAREST_M
        zero = np.zeros_like(z)
        by_xyz = np.stack(
            (
                np.stack((1 / depth, zero, -(ahead * x) / depth**2), axis=-1),
                np.stack((zero, 1 / depth, -(ahead * y) / depth**2), axis=-1),
            ),
            axis=-2,
        )  # (F, M, 2, 3)
        slope: Array = (by_xyz @ rotation[:, None]) @ moves.points
        return slope


@dataclass(frozen=True, eq=False)
class TotalVariation(LossTerm):
    """How suddenly the accelerations ẍ of the J joints change (eq. 5), per frame², m.

    Attributes:
        joint_rows: (J,) rows of the points that are joint centres.
    """

    name = "total_variation"
    differences = 3

    joint_rows: IntArray

    @classmethod
    def of(cls, weight: float, problem: Problem, frames: int) -> Self:  # noqa: ARG003
        """See `LossTerm`."""
        return cls(weight, problem.joint_rows)

    def value(self, seen: Seen) -> Array:
        """1/J Σ_t Σ_j ‖ẍ_tj - ẍ_t-1,j‖₁."""
        jerk = self._jerk(seen)
        value: Array = np.sum(np.abs(jerk), axis=(-3, -2, -1)) / len(self.joint_rows)
        return value

    def residual(self, seen: Seen) -> gauss_newton.Term:
        """Components of ẍ_tj - ẍ_t-1,j, each by itself: (P, F - 3, J, 3, 1)."""
        share = self.weight / len(self.joint_rows)
        return gauss_newton.Term(self._jerk(seen)[..., None], share, np.ones_like, floor=0.001)

    def slope(self, seen: Seen, moves: Moves) -> Array:  # noqa: ARG002
        """Of the joints: (F, J, 3, 1, V)."""
        return moves.points[:, self.joint_rows][..., None, :]

    def _jerk(self, seen: Seen) -> Array:
        """Third differences of the joints: (P, F - 3, J, 3)."""
        return np.diff(seen.points_m[:, :, self.joint_rows], n=self.differences, axis=1)


def _weighted_squares(off: Array, weights: Array) -> Array:
    """Σ_t Σ_n w_n ‖off_tn‖² (P,) of vectors (P, F, M, 3) with weights (M,)."""
    squares: Array = np.einsum("...fmi,...fmi,m->...", off, off, weights)
    return squares


def _image_off(seen: Seen) -> Array:
    """Ideal image x/z, y/z of the points from the detections, (P, F, M, 2); as if 0.1 m in front at least."""
    xyz = _in_camera(seen)[2]
    image = xyz[..., :2] / np.maximum(xyz[..., 2:], NEAREST_M)
    off: Array = image - seen.targets.rays
    return off


def _in_camera(seen: Seen) -> tuple[Array, Array, Array]:
    """Rotation (F, 3, 3) and translation (F, 3) into the camera, and the points there, (P, F, M, 3)."""
    camera = seen.targets.world_to_camera
    if camera is None:
        raise ValueError("targets: no world_to_camera; valid is (F, 4, 4) for a term that needs a camera")
    rotation, translation = camera[..., :3, :3], camera[..., :3, 3]
    xyz = seen.points_m @ np.swapaxes(rotation, -1, -2) + translation[..., None, :]
    return rotation, translation, xyz
