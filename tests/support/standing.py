"""The template in T-pose as joints: 12 of the body, heels and toes on the floor."""

from __future__ import annotations

import numpy as np

from simrecon import body as bodies
from simrecon.metrics.truth import BODY_JOINTS, FOOT_POINTS
from simrecon.types import Array

NAMES = (*BODY_JOINTS, *FOOT_POINTS)


def standing(height_m: float = 0.0) -> Array:
    """(16, 3) joints of `NAMES`, 1.7 m tall, the lowest at a height."""
    skeleton = bodies.scaled({}, 1.7)
    places = bodies.t_pose_m(skeleton)[skeleton.point_segments] + skeleton.point_offsets_m
    at = dict(zip(skeleton.point_names, places, strict=True))
    joints = np.array([at[name] for name in NAMES])
    return joints + np.array([0.0, 0.0, height_m - joints[:, 2].min()])
