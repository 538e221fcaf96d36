"""A short clip of a person who stands and sways, ready for an engine."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import kinematics, planners, prior, schedule
from simrecon.engines import problem as problems
from simrecon.engines.problem import Problem
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.plan import LossWeights, Optimiser, Plan, Recovery, Simulation, WindowPlan
from simrecon.types import Camera, Evidence, KinematicFit, Lens, Scene

FRAMES, FRAME_S = 13, 1 / 30
LENS = Lens(
    np.array([[800.0, 0.0, 320.0], [0.0, 800.0, 240.0], [0.0, 0.0, 1.0]]),
    np.array([-0.1, 0.02, 0.001, 0.0, 0.0]),
    (640, 480),
)
WORLD_TO_CAMERA = np.array(
    [[0.0, -1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 1.0], [1.0, 0.0, 0.0, 4.0], [0.0, 0.0, 0.0, 1.0]]
)
CAMERA = cameras.still(LENS, WORLD_TO_CAMERA, FRAMES)
LOSSES: dict[str, Any] = {
    "com_position": 15.0,
    "com_velocity": 15.0,
    "pose": 0.5,
    "reprojection": 0.0,
    "prior": 0.0,
    "total_variation": 0.0,
    "joint_limit": 0.0,
    "landmark": 0.0,
    "landmark_velocity": 0.0,
    "planted": 0.0,
    "wished": 0.0,
    "borne": 0.0,
    "prior_model": "gaussian",
    "prior_rate_hz": 30.0,
    "rate_hz": 30.0,
}


def settings(
    *,
    length_s: float = 0.5,
    overlap_s: float = 0.0,
    population: int = 16,
    generations: int = 5,
    start: float = 0.0,
    descent: int = 0,
    draft: int = 0,
    corridor_m: float = 0.0,
    retries: int = 0,
    **losses: Any,
) -> Plan:
    return Plan(
        "a test",
        Simulation(0.012, "usual"),
        WindowPlan(length_s, overlap_s, 0.2),
        Optimiser(
            covariance="diagonal",
            population=population,
            generations=generations,
            draft_steps=draft,
            descent_steps=descent,
            spread=1.0,
            sigma_rad=0.1,
            bound_rad=1.5,
            start_pose=start,
            start_velocity=10 * start,
            tol_loss=0.0,
            tol_sigma=0.0,
        ),
        Recovery(corridor_m, retries),
        LossWeights(**(LOSSES | losses)),
        None,  # type: ignore[arg-type]  # engines are not to look at it
    )


def standing(camera: Camera | None = None, frames: int = FRAMES) -> KinematicFit:
    """Relaxed on the floor, with arms that rise."""
    skeleton = bodies.scaled({}, 1.75)
    person = bodies.build(skeleton, height_m=1.75, mass_kg=70.0, sole_m=0.0)
    rotvecs = np.tile(prior.gaussian(skeleton).mean_rad, (frames, 1, 1))  # (T, 16, 3)
    for side in ("left", "right"):
        rotvecs[:, skeleton.names.index(f"{side}_elbow") - 1, 2] += np.linspace(0, 0.4, frames)
    qpos = np.zeros((frames, 71))
    qpos[:, 3] = 1.0
    qpos[:, 7:] = rotations.exp(rotvecs).reshape(frames, -1)
    _, points = kinematics.configurations(person, qpos)
    feet = [skeleton.point_names.index(name) for name in ("left_heel", "left_toe")]
    qpos[:, 2] = -points[0, feet, 2].min() + 0.003
    com, _ = kinematics.configurations(person, qpos)
    return KinematicFit(
        body=person,
        scene=Scene(),
        camera=camera,
        times_s=np.arange(frames, dtype=float) * FRAME_S,
        qpos=qpos,
        com_m=com,
        reprojection_px=np.zeros((frames, 0)),
        interpolated=np.zeros(frames, dtype=bool),
        iterations=0,
        loss={},
    )


def unseen(frames: int = FRAMES) -> Evidence:
    return Evidence(
        times_s=np.arange(frames, dtype=float) * FRAME_S,
        keypoint_names=(),
        keypoints_px=np.zeros((frames, 0, 2)),
        scores=np.zeros((frames, 0)),
        joint_names=(),
        joints_m=np.zeros((frames, 0, 3)),
        joints_frame="world",
    )


def clip(plan: Plan, fit: KinematicFit | None = None, evidence: Evidence | None = None) -> Problem:
    fit = standing() if fit is None else fit
    clock = schedule.clock(fit.times_s, plan.simulation.timestep_max_s)
    evidence = unseen(len(fit.times_s)) if evidence is None else evidence
    return problems.pose(fit, planners.plan("none", fit, evidence, plan), evidence, clock, plan)


class Makers:
    """The functions of this file, for the tests beside it, and a camera."""

    camera = CAMERA
    settings: Callable[..., Plan] = staticmethod(settings)
    standing: Callable[..., KinematicFit] = staticmethod(standing)
    unseen: Callable[..., Evidence] = staticmethod(unseen)
    clip: Callable[..., Problem] = staticmethod(clip)


@pytest.fixture(scope="session")
def make() -> type[Makers]:
    return Makers
