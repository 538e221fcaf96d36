"""A motion as the network sees it: joints relative to the pelvis, and how the pelvis moves.

Xie 2021, section 3.4: root-relative places of joints and velocities of the root. Of the vertical the height
over the floor takes the place of the velocity, whose errors add up to persons who float or sink. A motion
and its future are turned about the vertical so that the person faces along x in the last frame that is known,
and scaled to a person of `HEIGHT_M`. The rate is 30 Hz; the paper's is 50 Hz.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon.metrics.truth import BODY_JOINTS, FOOT_POINTS
from simrecon.types import Array

RATE_HZ = 30.0
CONTEXT, FUTURE = 15, 60
"""Frames: 0.5 s that are known, 2 s that follow."""
SCORED = ("pelvis", "neck", "head", *BODY_JOINTS)
"""The skeleton of 15 joints of the paper's scores."""
POINTS = (*SCORED, *FOOT_POINTS)
"""What is predicted, the root first: heels and toes too, for they say how the feet lie."""
COUNT = 3 * len(POINTS)
"""Features of a frame: joints but the root, m; what the root travels in `TRAVEL_S`, m; its height, m."""
TRAVEL_S = 0.1
"""Brings velocities to the size of places."""
HEIGHT_M = 1.7
_LEFT, _RIGHT = POINTS.index("left_hip"), POINTS.index("right_hip")


@dataclass(frozen=True, eq=False)
class Stand:
    """Where and how a person is in the last frame that is known.

    Attributes:
        axes: (3, 3) rows: forward, left and up, level, in the world.
        root_m: (3,) place of the pelvis.
        size: stature by `HEIGHT_M`.
        floor_m: height of the floor.
    """

    axes: Array
    root_m: Array
    size: float
    floor_m: float = 0.0


def stand(joints_m: Array, height_m: float, floor_m: float = 0.0) -> Stand:
    """How a person is in a frame.

    Args:
        joints_m: (K, 3) `POINTS` in the world.
        height_m: stature.
        floor_m: height of the floor.
    """
    across = joints_m[_LEFT] - joints_m[_RIGHT]
    yaw = np.arctan2(-across[0], across[1])
    cos, sin = np.cos(yaw), np.sin(yaw)
    axes = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return Stand(axes, joints_m[0].copy(), height_m / HEIGHT_M, floor_m)


def features(joints_m: Array, at: Stand) -> Array:
    """Features (..., T, COUNT) of joints (..., T, K, 3); the first frame has the velocity of the second."""
    own = (joints_m - joints_m[..., :1, :]) @ at.axes.T / at.size  # (..., T, K, 3)
    travel = np.diff(joints_m[..., 0, :], axis=-2) @ at.axes.T * (RATE_HZ * TRAVEL_S / at.size)
    travel = np.concatenate((travel[..., :1, :], travel), axis=-2)  # (..., T, 3)
    travel[..., 2] = (joints_m[..., 0, 2] - at.floor_m) / at.size
    return np.concatenate((own[..., 1:, :].reshape(*travel.shape[:-1], -1), travel), axis=-1)


def places(values: Array, at: Stand) -> Array:
    """Joints (..., F, K, 3) in the world of features (..., F, COUNT) that follow a frame."""
    travel = values[..., -3:] @ at.axes * (at.size / (RATE_HZ * TRAVEL_S))
    root = at.root_m + np.cumsum(travel, axis=-2)  # (..., F, 3)
    root[..., 2] = at.floor_m + at.size * values[..., -1]
    own = values[..., :-3].reshape(*values.shape[:-1], len(POINTS) - 1, 3) @ at.axes * at.size
    return np.concatenate((root[..., None, :], root[..., None, :] + own), axis=-2)
