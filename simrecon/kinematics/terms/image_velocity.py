"""The term of the landmarks' velocities in the image."""

from __future__ import annotations

from typing import cast

import numpy as np

from simrecon.kinematics.gradient import Gradient
from simrecon.kinematics.hessian import Hessian
from simrecon.kinematics.observations import Observations
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.state import State
from simrecon.kinematics.terms.image import LEAST_DEPTH_M, in_camera
from simrecon.kinematics.terms.kernels import cauchy
from simrecon.kinematics.terms.term import Term
from simrecon.types import Array

SPEED_SIGMA_S = 0.1  # velocities may differ by the scale of a detection in this time


class KeypointVelocity(Term):
    """Landmarks move in the image as their detections do."""

    name = "keypoint_velocity"
    temporal = True

    def applies(self, problem: Problem) -> bool:
        """With landmarks in the image only."""
        return problem.observations.world_to_camera is not None

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Robust difference of the velocities in the ideal image plane."""
        see = state.problem.observations
        camera = cast(Array, see.world_to_camera)
        loss, slope = velocity(
            state.landmarks_m, see.rays, _of_steps(see.ray_weights), camera, state.dt, _speed_sigma(see)
        )
        gradient.landmarks += unit * slope
        return unit * loss

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """With the robust weights of this state."""
        see = state.problem.observations
        place, project = projected(state.landmarks_m, cast(Array, see.world_to_camera))
        scale = state.dt * _speed_sigma(see)
        off = np.diff(place - see.rays, axis=1) / scale  # (M, T - 1, 2)
        slope = 1 / (1 + np.sum(off**2, axis=-1))
        each = (2 * weight * state.dt * _of_steps(see.ray_weights) * slope / scale**2).T  # (T - 1, M)
        own = np.zeros((state.problem.frames, each.shape[1]))
        own[:-1] += each
        own[1:] += each
        moves = np.swapaxes(project, 0, 1) @ hessian.jacobian.landmarks  # (T, M, 2, FREE)
        hessian.others.append((moves, [own, -each, np.zeros_like(each[1:])]))


def _of_steps(weights: Array) -> Array:
    """Weights (M, T - 1) of the steps from a frame to the next: that of the less certain one."""
    return np.minimum(weights[:, 1:], weights[:, :-1])


def _speed_sigma(see: Observations) -> float:
    """Difference of velocities at which a detection counts half, per second."""
    return see.ray_sigma / SPEED_SIGMA_S


def velocity(
    points_m: Array, rays: Array, weights: Array, world_to_camera: Array, interval_s: float, sigma: float
) -> tuple[float, Array]:
    """Difference between velocities of projected points and of undistorted detections, robust.

    Args:
        points_m: (M, T, 3) world.
        rays: (M, T, 2) detections as x/z, y/z.
        weights: (M, T - 1) of the steps, zero where not seen before and after.
        world_to_camera: (4, 4) or (T, 4, 4).
        interval_s: between frames.
        sigma: difference at which a detection counts half, in the units of `rays` per second.
    """
    place, project = projected(points_m, world_to_camera)
    residual = np.diff(place - rays, axis=1) / (interval_s * sigma)  # (M, T - 1, 2)
    loss, slope = cauchy(np.sum(residual**2, axis=-1))
    d_step = (2 * weights * slope)[..., None] * residual / (interval_s * sigma)
    d_place = np.zeros_like(place)
    d_place[:, 1:] += d_step
    d_place[:, :-1] -= d_step
    gradient = (np.swapaxes(project, -1, -2) @ d_place[..., None])[..., 0]
    return float(np.sum(weights * loss)), gradient


def projected(points_m: Array, world_to_camera: Array) -> tuple[Array, Array]:
    """Points in the ideal image plane (M, T, 2), and the derivative by them (M, T, 2, 3)."""
    xyz, rotation = in_camera(points_m, world_to_camera)
    depth = np.maximum(xyz[..., 2], LEAST_DEPTH_M)
    place = xyz[..., :2] / depth[..., None]
    project = np.zeros((*depth.shape, 2, 3))
    project[..., 0, 0] = project[..., 1, 1] = 1 / depth
    project[..., 2] = np.where(xyz[..., 2:] > LEAST_DEPTH_M, -place / depth[..., None], 0.0)
    return place, project @ rotation
