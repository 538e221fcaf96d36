"""A person who walks, and what a camera sees of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import prior
from simrecon.body import primitives
from simrecon.contact import labels
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.kinematics import forward
from simrecon.kinematics.contacts import contact_points
from simrecon.kinematics.layout import SEGMENTS, Variables
from simrecon.kinematics.observations import Observations
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.terms import PLANNED
from simrecon.plan import Kinematics
from simrecon.types import Array, Camera, Evidence, Ground, Lens, Scene, SceneItem, Skeleton

HEIGHT_M = 1.75
FEW = 4
"""Frames of the problem that all terms are tested with."""
STEP = SceneItem("step", "box", (0.25, 0.1, 0.0), {"size_m": (0.4, 0.8, 0.12)}, yaw_rad=0.3)
MATRIX_PX = np.array([[1000.0, 0.0, 640.0], [0.0, 1000.0, 480.0], [0.0, 0.0, 1.0]])

Repeated = Callable[[int], tuple[Problem, Array]]
"""Frames → the problem with so many, and a point of it."""


@dataclass(frozen=True, eq=False)
class Walk:
    """A known motion: root_m (T, 3), rotvecs (SEGMENTS, T, 3), and the points (M, T, 3) that follow."""

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
    rotvecs = np.zeros((SEGMENTS, frames, 3))
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
    assert evidence.camera is not None
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
    seen: Callable[..., Evidence] = seen
    in_camera: Callable[..., Evidence] = in_camera


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


@pytest.fixture(scope="session")
def problem(make: Makers, weights: Kinematics) -> Problem:
    """Every term counts: feet within the floor and a box, joints beyond their limits, noise on everything."""
    rng = np.random.default_rng(7)
    walk = make.walking(FEW)
    skeleton, count = walk.skeleton, len(walk.skeleton.point_names)
    camera = make.looking_at(np.array([4.0, -1.0, 1.5]), np.array([0.0, 0.0, 1.0]))
    rays = cameras.undistort(camera.lens, cameras.project(camera, walk.points_m))
    roots = np.zeros(count)
    roots[[skeleton.point_names.index(f"{side}_hip") for side in ("left", "right")]] = 0.5
    gaussian = prior.gaussian(skeleton)
    see = Observations(
        interval_s=1 / 30,
        rays=rays + rng.normal(scale=0.02, size=rays.shape),
        ray_weights=rng.uniform(0, 1, (count, FEW)),
        ray_sigma=0.01,
        world_to_camera=cameras.extrinsics(cameras.lasting(camera, FEW)),
        joints_m=walk.points_m - walk.root_m + rng.normal(scale=0.05, size=walk.points_m.shape),
        joint_weights=rng.integers(0, 2, (count, FEW)).astype(float),
        place_m=walk.root_m + 0.1,
        place_weights=np.array([1.0, 0.0, 1.0, 1.0]),
        root_weights=roots,
        labels=labels.of_feet_and_hips(rng.uniform(0, 1, (2, FEW)), rng.uniform(0, 1, FEW), "test"),
        scale_sigma=0.1,
        neutral=gaussian.mean_rad,
        spread=gaussian.spread_rad,
        prior=gaussian,
    )
    parts = primitives.make(skeleton, 1.75, 70.0, 0.0)
    # a term that `weights` leaves out counts, too
    others: dict[str, Any] = {term.name: 1.0 for term in PLANNED if not term.weight(weights)}
    base = np.broadcast_to(rotations.matrix(rotations.exp(np.array([0.1, 0.0, 0.4]))), (FEW, 3, 3))
    touch, plan = contact_points(skeleton, parts), replace(weights, **others)
    return Problem.of_clip(skeleton, touch, Scene(Ground(0.02), (STEP,)), base, see, plan)


@pytest.fixture(scope="session")
def point(make: Makers, problem: Problem) -> Array:
    """Packed variables somewhere near the walk."""
    rng = np.random.default_rng(8)
    walk = make.walking(FEW)
    rotvecs = walk.rotvecs + rng.normal(scale=0.2, size=walk.rotvecs.shape)
    rotvecs[walk.skeleton.names.index("left_elbow"), :, 2] += 2.0
    root = walk.root_m + np.array([0.0, 0.0, -0.03]) + rng.normal(scale=0.02, size=walk.root_m.shape)
    lengths = rng.normal(scale=0.03, size=len(problem.stretch))
    lean = rng.normal(scale=0.1, size=(problem.leans.shape[1], 3))
    return Variables(root, rotvecs, 0.07, 0.012, lengths, lean).pack()


@pytest.fixture
def repeated(problem: Problem, point: Array) -> Repeated:
    """The problem's frames again and again, and a point of it."""

    def repeat(frames: int) -> tuple[Problem, Array]:
        rows = np.arange(frames) % FEW
        see, base = problem.observations.part(rows), problem.base[rows]
        long = Problem.of_clip(problem.skeleton, problem.contacts, problem.scene, base, see, problem.plan)
        lean = np.random.default_rng(14).normal(scale=0.1, size=(long.leans.shape[1], 3))
        return long, replace(problem.unpack(point).part(rows), lean=lean).pack()

    return repeat
