"""Velocity, acceleration and jitter, by frame, as pure functions of arrays (docs/metrics.md).

Errors are of steps from frame to frame: times the rate they are velocities. The score of each is their mean
(`statistics.of_frames`). Axes: T frames, J joints, F foot points; leading axes are batches.
"""

from __future__ import annotations

import numpy as np

from simrecon.metrics.pose import distances
from simrecon.types import Array


def steps(points: Array) -> Array:
    """Distance that each point moves between frames, (..., T, F, 3) → (..., T - 1, F)."""
    return np.asarray(np.linalg.norm(np.diff(points, axis=-3), axis=-1))


def velocity_errors(joints: Array, truth: Array) -> Array:
    """Norm of the difference of the joints' steps as vectors, m a frame; (..., T, J, 3) → (..., T - 1, J)."""
    return distances(np.diff(joints, axis=-3), np.diff(truth, axis=-3))


def speed_errors(joints: Array, truth: Array) -> Array:
    """Absolute difference of the lengths of the joints' steps, m a frame; (..., T, J, 3) → (..., T - 1, J).

    Velocity of Gärtner 2022 eq. 10, with a mean over the joints where it prints a sum (docs/metrics.md says
    why); the alignment of the first frame that the paper asks for cancels in the differences.

    e_smooth of Xie 2021 eqs. 8–10, after PhysCap (Shimada 2020): Jit = ‖p_t − p_{t−1}‖ in both motions.
    Eq. 10 prints Σ‖p_t^GT − p_{t−1}^GT‖, which no estimate enters; their text says "difference in velocity
    magnitude", which is taken here. Both at 25 frames a second in the papers' tables.
    """
    return np.abs(steps(joints) - steps(truth))


def acceleration_errors(joints: Array, truth: Array) -> Array:
    """Norm of the difference of the joints' second differences, m a frame²; (..., T, J, 3) → (..., T - 2, J).

    Kanazawa et al. 2019 (HMMR).
    """
    return distances(np.diff(joints, 2, axis=-3), np.diff(truth, 2, axis=-3))


def jerks(joints: Array, rate_hz: float) -> Array:
    """Jitter: norm of the joints' third derivative, m/s³; (..., T, J, 3) → (..., T - 3, J).

    No reference enters. WHAM (Shin 2024) and GVHMR (Shen 2024) print its mean in units of 10 m/s³, at 30
    frames a second; a higher rate lets more noise through.
    """
    return np.asarray(np.linalg.norm(np.diff(joints, 3, axis=-3), axis=-1) * rate_hz**3)


def foot_height_errors(feet: Array, truth_feet: Array) -> Array:
    """e_foot,z: absolute error of the feet's height, m; (..., T, F, 3) → (..., T, F). Xie 2021 eq. 11."""
    return np.abs(feet[..., 2] - truth_feet[..., 2])


def foot_step_errors(feet: Array, truth_feet: Array) -> Array:
    """e_foot,vxy: norm of the difference of horizontal steps, m a frame; (..., T, F, 3) → (..., T - 1, F).

    Xie 2021 eq. 12, at 25 frames a second in their table.
    """
    return velocity_errors(feet[..., :2], truth_feet[..., :2])
