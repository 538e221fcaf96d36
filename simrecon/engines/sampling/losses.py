"""Loss terms of a rollout, Gärtner et al. 2022 eq. 1 to 5 and L_lim; pure, batched over leading axes.

F frames of a window, frame interval dt. Each term sums over frames and returns shape (...).
"""

from __future__ import annotations

import numpy as np

from simrecon.geometry import rotations
from simrecon.types import Array

LIMIT_SCALE_RAD = 0.1
"""Excess at which the penalty of L_lim is e - 1. The paper says exponential and gives no constant."""
LIMIT_EXCESS_MAX_RAD = 3.0


def com_position(com_m: Array, target_m: Array) -> Array:
    """Σ_t ‖c_t - c_t^k‖² (eq. 1, first part); (..., F, 3) and (F, 3), m²."""
    loss: Array = np.sum((com_m - target_m) ** 2, axis=(-2, -1))
    return loss


def com_velocity(com_m: Array, target_m: Array, interval_s: float) -> Array:
    """Σ_t ‖ċ_t - ċ_t^k‖² by finite differences (eq. 1, second part); (..., F, 3) and (F, 3), m²/s²."""
    difference = np.diff(com_m - target_m, axis=-2) / interval_s
    loss: Array = np.sum(difference**2, axis=(-2, -1))
    return loss


def pose(orientations: Array, targets: Array) -> Array:
    """Σ_t Σ_j arccos |⟨q, q^k⟩| over all joints and the base (eq. 2); (..., F, B, 4) and (F, B, 4), rad."""
    dot = np.abs(np.einsum("...bi,...bi->...b", orientations, targets))
    loss: Array = np.sum(np.arccos(np.minimum(dot, 1.0)), axis=(-2, -1))
    return loss


def reprojection(points_m: Array, rays: Array, scores: Array, world_to_camera: Array) -> Array:
    """Σ_t Σ_n s_tn ‖C l_tn - l^d_tn‖₂ (eq. 3) in the ideal image plane.

    The paper leaves the unit of the image open; here it is the focal length, and detections are undistorted.

    Args:
        points_m: (..., F, M, 3).
        rays: (F, M, 2) undistorted detections x/z, y/z.
        scores: (F, M), zero where not seen.
        world_to_camera: (4, 4) or (F, 4, 4).
    """
    distance = np.sqrt(np.sum((image_plane(points_m, world_to_camera) - rays) ** 2, axis=-1))
    loss: Array = np.sum(scores * distance, axis=(-2, -1))
    return loss


def image_plane(points_m: Array, world_to_camera: Array) -> Array:
    """Ideal image x/z, y/z (..., F, M, 2) of points (..., F, M, 3)."""
    rotation, translation = world_to_camera[..., :3, :3], world_to_camera[..., :3, 3]
    xyz = points_m @ np.swapaxes(rotation, -1, -2) + translation[..., None, :]  # (..., F, M, 3)
    image: Array = xyz[..., :2] / np.maximum(xyz[..., 2:], 0.1)
    return image


def prior(latent: Array) -> Array:
    """Σ_t ‖z(q_t)‖₂ (eq. 4); latent codes (..., F, D)."""
    loss: Array = np.sum(np.linalg.norm(latent, axis=-1), axis=-1)
    return loss


def total_variation(joints_m: Array) -> Array:
    """1/J Σ_t Σ_j ‖ẍ_tj - ẍ_t-1,j‖₁ (eq. 5); joints (..., F, J, 3), accelerations per frame², m."""
    jerk = np.diff(joints_m, n=3, axis=-3)
    loss: Array = np.sum(np.abs(jerk), axis=(-3, -2, -1)) / joints_m.shape[-2]
    return loss


def joint_limit(rotvecs: Array, limits_rad: Array) -> Array:
    """L_lim: Σ_t Σ exp(excess / scale) - 1 over joint components outside their range.

    Args:
        rotvecs: (..., F, 16, 3).
        limits_rad: (16, 3, 2).
    """
    excess = limit_excess(rotvecs, limits_rad)
    loss: Array = np.sum(np.expm1(excess / LIMIT_SCALE_RAD), axis=(-3, -2, -1))
    return loss


def joint_limit_slope(excess: Array) -> Array:
    """Derivative of the penalty of one component with respect to its excess."""
    slope: Array = np.exp(excess / LIMIT_SCALE_RAD) / LIMIT_SCALE_RAD
    return slope


def limit_excess(rotvecs: Array, limits_rad: Array) -> Array:
    """How far each component is outside its range, (..., F, 16, 3), rad; zero within."""
    excess = np.maximum(rotvecs - limits_rad[..., 1], limits_rad[..., 0] - rotvecs)
    return np.clip(excess, 0.0, LIMIT_EXCESS_MAX_RAD)


def landmark(points_m: Array, targets_m: Array, weights: Array) -> Array:
    """Σ_t Σ_n w_n ‖l_tn - l^k_tn‖² to the kinematic fit, m²; not in the paper.

    Args:
        points_m: (..., F, M, 3).
        targets_m: (F, M, 3).
        weights: (M,).
    """
    off = points_m - targets_m
    loss: Array = np.einsum("...fmi,...fmi,m->...", off, off, weights)
    return loss


def landmark_velocity(points_m: Array, targets_m: Array, weights: Array, interval_s: float) -> Array:
    """Σ_t Σ_n w_n ‖d/dt (l_tn - l^k_tn)‖², m²/s², by finite differences; shapes as `landmark`."""
    return landmark(np.diff(points_m, axis=-3), np.diff(targets_m, axis=-3), weights / interval_s**2)


def joint_rotvecs(orientations: Array) -> Array:
    """Rotation vectors (..., 16, 3) of the joints in orientations (..., 17, 4), the base first."""
    return rotations.log(orientations[..., 1:, :])
