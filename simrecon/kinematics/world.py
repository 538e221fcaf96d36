"""The world in which a clip is fitted: camera as the evidence has it, or by the 3D estimate, or level."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.kinematics.observations import Observations
from simrecon.types import Array, Camera, Evidence, KinematicFit, Lens

LEVEL = np.array([[0.0, -1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""World to camera of a camera at the origin that looks along x and stands upright."""


def provisional(evidence: Evidence) -> Camera | None:
    """The camera with a path, to begin with.

    Without one it is taken for still: placed by the 3D estimate where that is in the world
    (perspective-n-point over all frames), and upright at the origin otherwise.
    """
    camera = evidence.camera
    if camera is None or camera.path is not None:
        return camera
    return cameras.still(camera.lens, _placed(evidence, camera.lens), len(evidence.times_s))


def _placed(evidence: Evidence, lens: Lens) -> Array:
    """The transform (4, 4) of a camera that stands still."""
    shared = [name for name in evidence.joint_names if name in evidence.keypoint_names]
    if evidence.joints_frame != "world" or len(shared) < 4:
        return LEVEL
    world = evidence.joints_m[:, [evidence.joint_names.index(name) for name in shared]].reshape(-1, 3)
    pixels = evidence.keypoints_px[:, [evidence.keypoint_names.index(name) for name in shared]].reshape(-1, 2)
    known = np.isfinite(world).all(axis=1) & np.isfinite(pixels).all(axis=1)
    if known.sum() < 6:
        return LEVEL
    found = cameras.resected(lens, world[known], pixels[known])
    return LEVEL if found is None else found


def placed(fit: KinematicFit, camera: Camera | None) -> KinematicFit:
    """A fit whose world has no place and heading of its own, moved to where the camera really stands.

    The world of a camera that nobody knows begins below it and looks along it; only up and the floor say
    something of the real one. So the fit is turned about the vertical and shifted over the floor, until its
    camera stands where the real one does in the first frame, and looks to the same side.

    Args:
        fit: of a camera that is placed by it.
        camera: the real one; without a path nothing is moved.
    """
    if camera is None or camera.path is None or fit.camera is None:
        return fit
    ours, theirs = (cameras.extrinsics(one)[0] for one in (fit.camera, camera))
    across = [np.arctan2(one[0, 1], one[0, 0]) for one in (ours, theirs)]  # of the image's x axis
    move = np.eye(4)
    move[:3, :3] = rotations.matrix(rotations.exp(np.array([0.0, 0.0, across[1] - across[0]])))
    places = [-one[:3, :3].T @ one[:3, 3] for one in (ours, theirs)]
    move[:2, 3] = (places[1] - move[:3, :3] @ places[0])[:2]
    turn = rotations.from_matrix(move[:3, :3])
    qpos = fit.qpos.copy()
    qpos[:, :3] = qpos[:, :3] @ move[:3, :3].T + move[:3, 3]
    qpos[:, 3:7] = rotations.canonical(rotations.multiply(turn, qpos[:, 3:7]))
    com = fit.com_m @ move[:3, :3].T + move[:3, 3]
    return replace(
        fit, qpos=qpos, com_m=com, camera=moved(fit.camera, move), world=move @ fit.world, spread_m=None
    )


def in_world(camera: Camera | None, points_m: Array) -> Array:
    """Points (M, T, 3) of the camera's frame in the world; without a camera, of one that stands level."""
    if camera is None:
        return np.asarray((points_m - LEVEL[:3, 3]) @ LEVEL[:3, :3])
    return cameras.to_world(camera, points_m)


def moved(camera: Camera | None, transform: Array) -> Camera | None:
    """The camera after the world was moved by `transform` (4, 4)."""
    if camera is None:
        return None
    return cameras.with_path(camera, cameras.extrinsics(camera) @ np.linalg.inv(transform))


def observed(see: Observations, transform: Array, camera: Camera | None) -> Observations:
    """What is observed after the world was moved by `transform` (4, 4), and the camera with it."""
    rotation, shift = transform[:3, :3], transform[:3, 3]
    moved: Observations = replace(
        see,
        joints_m=see.joints_m @ rotation.T,
        place_m=see.place_m @ rotation.T + shift,
        world_to_camera=None if see.world_to_camera is None or camera is None else cameras.extrinsics(camera),
    )
    return moved
