"""Velocity, acceleration and jitter, as pure functions of arrays; docs/metrics.md sets the variants apart.

Axes: T frames, J joints, F foot points; leading axes are batches.
"""

from __future__ import annotations

import numpy as np

from simrecon.metrics.pose import distances, mean_known, mpjpe_g
from simrecon.types import Array


def velocity(joints: Array, truth: Array, interval_s: float) -> Array:
    """Mean norm of the difference of the joints' velocity vectors, m/s; (..., T, J, 3) → (...)."""
    return mpjpe_g(np.diff(joints, axis=-3), np.diff(truth, axis=-3)) / interval_s


def velocity_gartner(joints: Array, truth: Array, interval_s: float) -> Array:
    """Mean absolute difference of the joints' speeds, m/s; (..., T, J, 3) → (...).

    Gärtner 2022 eq. 10, with a mean over the joints where it prints a sum (docs/metrics.md says why).
    The alignment of the first frame that the paper asks for cancels in the differences.
    """
    return mean_known(_speed_errors(joints, truth), (-2, -1)) / interval_s


def acceleration(joints: Array, truth: Array, interval_s: float) -> Array:
    """Mean norm of the difference of the joints' acceleration vectors, m/s²; (..., T, J, 3) → (...).

    Kanazawa et al. 2019 (HMMR), who print it in mm per squared frame.
    """
    return mpjpe_g(np.diff(joints, 2, axis=-3), np.diff(truth, 2, axis=-3)) / interval_s**2


def e_smooth(joints: Array, truth: Array) -> Array:
    """e_smooth: mean absolute difference of the joints' steps from frame to frame, m; (..., T, J, 3) → (...).

    Xie 2021 eqs. 8–10, after PhysCap (Shimada 2020): Jit = ‖p_t − p_{t−1}‖ in both motions. Eq. 10 prints
    Σ‖p_t^GT − p_{t−1}^GT‖, which no estimate enters; their text says "difference in velocity magnitude",
    which is taken here, as a mean over frames and joints. It is in metres a frame: bring both motions to
    25 frames a second to compare with their table.
    """
    return mean_known(_speed_errors(joints, truth), (-2, -1))


def e_foot_z(feet: Array, truth_feet: Array) -> Array:
    """e_foot,z: mean absolute difference of the feet's height, m; (..., T, F, 3) → (...). Xie 2021 eq. 11."""
    return mean_known(np.abs(feet[..., 2] - truth_feet[..., 2]), (-2, -1))


def e_foot_vxy(feet: Array, truth_feet: Array) -> Array:
    """e_foot,vxy: mean norm of the difference of horizontal steps, m a frame; (..., T, F, 3) → (...).

    Xie 2021 eq. 12, at 25 frames a second in their table.
    """
    step, truth_step = (np.diff(x[..., :2], axis=-3) for x in (feet, truth_feet))
    return mpjpe_g(step, truth_step)


def jitter(joints: Array, interval_s: float) -> Array:
    """Mean norm of the joints' third derivative, m/s³; (..., T, J, 3) → (...). No reference enters.

    WHAM (Shin 2024) and GVHMR (Shen 2024) print it in units of 10 m/s³, at 30 frames a second; a higher rate
    lets more noise through.
    """
    third = np.linalg.norm(np.diff(joints, 3, axis=-3), axis=-1) / interval_s**3
    return mean_known(third, (-2, -1))


def _speed_errors(joints: Array, truth: Array) -> Array:
    """Absolute difference of the lengths of steps, (..., T - 1, J)."""
    zero = np.zeros(joints.shape[-1])
    step, truth_step = (distances(np.diff(x, axis=-3), zero) for x in (joints, truth))
    return np.abs(step - truth_step)
