"""A person who walks, and what a camera sees of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import prior
from simrecon.body import primitives
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.kinematics import forward
from simrecon.kinematics.contacts import contact_points
from simrecon.plan import Kinematics
from simrecon.types import Array, Camera, Evidence, Lens, Skeleton

HEIGHT_M = 1.75
MATRIX_PX = np.array([[1000.0, 0.0, 640.0], [0.0, 1000.0, 480.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, eq=False)
class Walk:
    """A known motion: root_m (T, 3), rotvecs (17, T, 3), and the points (M, T, 3) that follow from them."""

    skeleton: Skeleton
    times_s: Array
    root_m: Array
    rotvecs: Array
    points_m: Array

    @property
    def frames(self) -> int:
        return len(self.times_s)

    def at(self, *names: str) -> Array:
        """Points (T, names, 3)."""
        return np.swapaxes(self.points_m[[self.skeleton.point_names.index(name) for name in names]], 0, 1)


def walking(frames: int, rate_hz: float = 30.0, heading_rad: float = 0.5) -> Walk:
    """Steps on the floor z = 0, with swinging arms; the feet slide a little."""
    skeleton = bodies.scaled({}, HEIGHT_M)
    times_s = np.arange(frames) / rate_hz
    rotvecs = np.zeros((17, frames, 3))
    rotvecs[1:] = prior.gaussian(skeleton).mean_rad[:, None]
    rotvecs[0, :, 2] = heading_rad
    swing = np.sin(2 * np.pi * times_s)
    bent = 0.3 + 0.3 * np.cos(2 * np.pi * times_s)
    moves = {
        "left_hip": -0.2 - 0.4 * swing,
        "right_hip": -0.2 + 0.4 * swing,
        "left_knee": bent,
        "right_knee": 0.6 - bent,
    }
    for name, angle in moves.items():
        i = skeleton.names.index(name)
        turn = rotations.exp(angle[:, None] * [0.0, 1.0, 0.0])
        rotvecs[i] = rotations.log(rotations.multiply(rotations.conjugate(skeleton.rest[i]), turn))
    for name, sign in (("left_shoulder", 1.0), ("right_shoulder", -1.0)):
        rotvecs[skeleton.names.index(name), :, 2] += 0.4 * sign * swing
    direction = np.array([np.cos(heading_rad), np.sin(heading_rad), 0.0])
    root = times_s[:, None] * direction
    level = np.broadcast_to(np.eye(3), (frames, 3, 3))
    parts = primitives.make(skeleton, HEIGHT_M, primitives.default_mass_kg(HEIGHT_M), 0.0)
    touch = contact_points(skeleton, parts)
    pose = forward.forward(skeleton, root, level, rotvecs, 1.0)
    places = forward.points(pose, touch.segments, touch.offsets_m)[..., 2] - touch.radii_m[:, None]
    root[:, 2] = -places.min(axis=0)
    pose = forward.forward(skeleton, root, level, rotvecs, 1.0)
    points = forward.points(pose, skeleton.point_segments, skeleton.point_offsets_m)
    return Walk(skeleton, times_s, root, rotvecs, points)


def looking_at(eye_m: Array, target_m: Array, frames: int = 1) -> Camera:
    """An upright camera that stands still."""
    ahead = (target_m - eye_m) / np.linalg.norm(target_m - eye_m)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    transform = np.eye(4)
    transform[:3, :3] = np.stack((right, np.cross(ahead, right), ahead))
    transform[:3, 3] = -transform[:3, :3] @ eye_m
    return cameras.still(Lens(MATRIX_PX, np.zeros(5), (1280, 960)), transform, frames)


def carried(camera: Camera, frames: int, turn_rad: float, move_m: float) -> Camera:
    """The camera panned about the vertical of its image, and moved across what it sees."""
    share = np.linspace(-0.5, 0.5, frames)[:, None]
    rotation = cameras.extrinsics(camera)[0, :3, :3]
    path = np.tile(np.eye(4), (frames, 1, 1))
    path[:, :3, :3] = rotations.matrix(rotations.exp(turn_rad * share * [0.0, 1.0, 0.0])) @ rotation
    centre = cameras.centre_m(camera)[0] + move_m * share * rotation[0]
    path[:, :3, 3] = -(path[:, :3, :3] @ centre[..., None])[..., 0]
    return cameras.with_path(camera, path)


def seen(walk: Walk, camera: Camera, noise_px: float = 0.0, noise_m: float = 0.0, seed: int = 0) -> Evidence:
    """All points in the image and, in the world, in 3D."""
    rng = np.random.default_rng(seed)
    points = np.swapaxes(walk.points_m, 0, 1)  # (T, M, 3)
    camera = cameras.lasting(camera, walk.frames) if cameras.is_still(camera) else camera
    pixels = cameras.project(camera, points)
    names = walk.skeleton.point_names
    return Evidence(
        times_s=walk.times_s,
        keypoint_names=names,
        keypoints_px=pixels + rng.normal(scale=noise_px, size=pixels.shape),
        scores=np.ones(pixels.shape[:2]),
        joint_names=names,
        joints_m=points + rng.normal(scale=noise_m, size=points.shape),
        joints_frame="world",
        camera=camera,
    )


def in_camera(evidence: Evidence, relative: bool) -> Evidence:
    """The 3D estimate in the frame of the camera, from its own origin or from between the hips."""
    joints = cameras.to_camera(evidence.camera, evidence.joints_m)
    if not relative:
        return replace(evidence, joints_m=joints, joints_frame="camera")
    hips = [evidence.joint_names.index(f"{side}_hip") for side in ("left", "right")]
    root = joints[:, hips].mean(axis=1, keepdims=True)
    return replace(evidence, joints_m=joints - root, joints_frame="camera_root_relative")


@dataclass(frozen=True)
class Makers:
    """The functions of this file, for the tests beside it."""

    walking: Callable[..., Walk] = walking
    looking_at: Callable[..., Camera] = looking_at
    carried: Callable[[Camera, int, float, float], Camera] = carried
    seen: Callable[..., Evidence] = seen
    in_camera: Callable[[Evidence, bool], Evidence] = in_camera


@pytest.fixture(scope="session")
def make() -> Makers:
    return Makers()


@pytest.fixture(scope="session")
def weights() -> Kinematics:
    return Kinematics(
        shape=True,
        poses=True,
        ground=True,
        temporal=True,
        seed_frames=0,
        keypoint=1.0,
        keypoint_scale_px=6.0,
        joint=0.3,
        joint_scale_m=0.1,
        place=0.5,
        place_scale_m=0.2,
        smooth_com=0.1,
        smooth_position=0.1,
        smooth_rotation=0.05,
        travel_position=0.01,
        travel_rotation=0.05,
        prior=0.002,
        prior_model="gaussian",
        limit=1.0,
        penetration=1.0,
        contact=2.0,
        still=0.1,
        balance=0.5,
        evaluations=400,
    )
