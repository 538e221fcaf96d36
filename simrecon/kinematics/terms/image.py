"""Terms of the landmarks in the image."""

from __future__ import annotations

from typing import cast

import numpy as np

from simrecon.kinematics.forward import rotated
from simrecon.kinematics.gradient import Gradient
from simrecon.kinematics.hessian import Hessian, gram
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.state import State
from simrecon.kinematics.terms.kernels import cauchy
from simrecon.kinematics.terms.term import Term
from simrecon.types import Array

LEAST_DEPTH_M = 0.1  # of a point; one nearer to the camera, or behind it, counts as if here


class Keypoint(Term):
    """Landmarks lie where they were detected in the image."""

    name = "keypoint"

    def applies(self, problem: Problem) -> bool:
        """With landmarks in the image only."""
        return problem.observations.world_to_camera is not None

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Robust distance in the ideal image plane."""
        see = state.problem.observations
        camera = cast(Array, see.world_to_camera)
        loss, slope = reprojection(state.landmarks_m, see.rays, see.ray_weights, camera, see.ray_sigma)
        gradient.landmarks += unit * slope
        return unit * loss

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """With the robust weights of this state."""
        see = state.problem.observations
        xyz, rotation = in_camera(state.landmarks_m, cast(Array, see.world_to_camera))
        depth = np.maximum(xyz[..., 2], LEAST_DEPTH_M)
        place = xyz[..., :2] / depth[..., None]
        slope = 1 / (1 + np.sum(((place - see.rays) / see.ray_sigma) ** 2, axis=-1))
        project = np.zeros((*depth.shape, 2, 3))
        project[..., 0, 0] = project[..., 1, 1] = 1 / depth
        project[..., 2] = -place / depth[..., None]
        project = project @ rotation
        each = 2 * see.ray_weights * slope / see.ray_sigma**2
        bent = np.swapaxes(each[..., None, None] * np.swapaxes(project, -1, -2) @ project, 0, 1)
        hessian.plain += gram(hessian.jacobian.wide, weight * state.dt * bent)


def reprojection(
    points_m: Array, rays: Array, weights: Array, world_to_camera: Array, sigma: float
) -> tuple[float, Array]:
    """Distance in the ideal image plane between projected points and undistorted detections, robust.

    Args:
        points_m: (M, T, 3) world.
        rays: (M, T, 2) detections as x/z, y/z.
        weights: (M, T), zero where not seen.
        world_to_camera: (T, 4, 4).
        sigma: distance at which a detection counts half, in the units of `rays`.
    """
    xyz, rotation = in_camera(points_m, world_to_camera)
    depth = np.maximum(xyz[..., 2:], LEAST_DEPTH_M)
    residual = (xyz[..., :2] / depth - rays) / sigma  # (M, T, 2)
    loss, slope = cauchy(np.sum(residual**2, axis=-1))
    d_image = (2 * weights * slope)[..., None] * residual / sigma  # (M, T, 2)
    d_depth = np.where(
        xyz[..., 2:] > LEAST_DEPTH_M, -np.sum(d_image * xyz[..., :2], axis=-1, keepdims=True) / depth**2, 0.0
    )
    d_camera = np.concatenate((d_image / depth, d_depth), axis=-1)  # (M, T, 3)
    return float(np.sum(weights * loss)), rotated(np.swapaxes(rotation, -1, -2), d_camera)


def in_camera(points_m: Array, world_to_camera: Array) -> tuple[Array, Array]:
    """Points (M, T, 3) on the axes of the camera, and its rotation (3, 3) or (T, 3, 3)."""
    rotation, translation = world_to_camera[..., :3, :3], world_to_camera[..., :3, 3]
    return rotated(rotation, points_m) + translation, rotation
