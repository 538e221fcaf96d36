"""Where the kinematic fit starts."""

from __future__ import annotations

import numpy as np

from simrecon import body as bodies
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.kinematics import limbs, root
from simrecon.kinematics.layout import Variables, leans
from simrecon.kinematics.observations import Observations
from simrecon.kinematics.terms.shared import SOLE_M
from simrecon.types import Array, Camera, Skeleton

DEPTH_SMOOTH_S = 0.2


def start(
    skeleton: Skeleton, see: Observations, camera: Camera | None, lengths: int
) -> tuple[Variables, Array]:
    """Variables to begin with, and the root orientations (T, 3, 3) from which its rotation vectors count.

    Args:
        skeleton: unscaled.
        see: evidence; T frames.
        camera: with extrinsics, or None.
        lengths: how many of the skeleton's lengths are unknowns.
    """
    base = root.orientation(skeleton, see.joints_m, see.joint_weights)
    frames = len(base)
    if see.world_to_camera is not None and camera is not None:
        both = see.ray_weights * see.joint_weights
        smooth = DEPTH_SMOOTH_S / see.interval_s
        if not both.any():
            base, joints_m = _facing_camera(camera, skeleton)
            place = root.position(see.rays, see.ray_weights, joints_m, camera, smooth)
        else:
            place = root.position(see.rays, both, see.joints_m, camera, smooth)
    else:
        place = root.filled(see.place_m, see.place_weights > 0)
    rotvecs = limbs.turned(skeleton, base, see.joints_m, see.joint_weights, see.neutral)
    lean = np.zeros((leans(frames, see.interval_s).shape[1], 3))
    return Variables(place, rotvecs, 0.0, SOLE_M, np.zeros(lengths), lean), base


def _facing_camera(camera: Camera, skeleton: Skeleton) -> tuple[Array, Array]:
    """Without any 3D estimate: a person who stands upright and faces the camera, relaxed."""
    forward = -cameras.extrinsics(camera)[:, 2, :3]  # (T, 3)
    yaw, level = np.arctan2(forward[:, 1], forward[:, 0]), np.zeros(len(forward))
    base = rotations.matrix(rotations.exp(np.stack((level, level, yaw), axis=-1)))  # (T, 3, 3)
    offsets = bodies.t_pose_m(skeleton)[skeleton.point_segments] + skeleton.point_offsets_m  # (M, 3)
    return base, np.moveaxis(base @ offsets.T, 2, 0)  # (M, T, 3)
