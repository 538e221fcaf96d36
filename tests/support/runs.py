"""Two small runs: a person whose motors hold a stance, and a whole reconstruction of a shallow squat."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import kinematics, pipeline, planners, schedule
from simrecon import plan as plans
from simrecon.engines import problem as problems
from simrecon.engines.problem import Problem
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.job import Job
from simrecon.pipeline import Reconstruction
from simrecon.plan import Plan
from simrecon.sim.state import initial_state, simulate
from simrecon.types import Array, Body, Camera, Evidence, KinematicFit, Lens, Scene, Window, WindowResult
from tests.support.window_results import solved

HEIGHT_M, MASS_KG, FRAME_S = 1.75, 70.0, 1 / 30


def job_of(output: Path, **changes: Any) -> Job:
    """The job that the squat is said to be of."""
    settings: dict[str, Any] = {"plan": plans.read("quick"), "seed": 3, "threads": 1}
    return Job(changes.pop("input", "squat.npz"), str(output), **(settings | changes))


@dataclass(frozen=True, eq=False)
class Held:
    """A simulation without any optimisation."""

    problem: Problem
    fit: KinematicFit
    windows: tuple[WindowResult, ...]
    evidence: Evidence


def person() -> Body:
    skeleton = bodies.scaled({}, HEIGHT_M)
    return bodies.build(skeleton, height_m=HEIGHT_M, mass_kg=MASS_KG, sole_m=0.02)


def squat(body: Body, depth_rad: Array) -> Array:
    """Configurations (T, nq) with bent knees and hips, soles level and on the floor."""
    skeleton = body.skeleton
    bend = {"hip": -1.0, "knee": 2.0, "ankle": -1.0}
    turns = np.zeros((len(depth_rad), len(skeleton.names) - 1, 3))
    for column, name in enumerate(skeleton.names[1:]):
        turns[:, column, 1] = bend.get(name.split("_")[-1], 0.0) * depth_rad
    joints = rotations.multiply(rotations.conjugate(skeleton.rest[1:]), rotations.exp(turns))
    qpos = np.concatenate((np.zeros((len(depth_rad), 7)), joints.reshape(len(depth_rad), -1)), axis=1)
    qpos[:, 3] = 1.0
    points = kinematics.configurations(body, qpos)[1]
    heel, toe = (skeleton.point_names.index(f"left_{end}") for end in ("heel", "toe"))
    qpos[:, 2] = 0.02 - 0.5 * (points[:, heel, 2] + points[:, toe, 2])
    return qpos


def camera(frames: int) -> Camera:
    """Level, four metres in front of the person, who faces it."""
    view = np.array([[0, 1.0, 0, 0], [0, 0, -1, 1], [-1, 0, 0, 4], [0, 0, 0, 1]])
    matrix = np.array([[600.0, 0, 320], [0, 600.0, 240], [0, 0, 1]])
    return cameras.still(Lens(matrix, np.zeros(5), (640, 480)), view, frames)


def seen(body: Body, qpos: Array, by: Camera | None = None) -> Evidence:
    """What a camera, `camera()` if None, and a perfect 3D estimate see of configurations (T, nq)."""
    by = camera(len(qpos)) if by is None else by
    points = kinematics.configurations(body, qpos)[1]
    names = body.skeleton.point_names
    pixels = cameras.project(by, points)
    return Evidence(
        times_s=FRAME_S * np.arange(len(qpos), dtype=float),
        keypoint_names=names,
        keypoints_px=pixels,
        scores=np.ones(pixels.shape[:2]),
        joint_names=names,
        joints_m=points,
        joints_frame="world",
        mass_kg=MASS_KG,
        height_m=HEIGHT_M,
        camera=by,
        sha256="0" * 64,
    )


def stepped(problem: Problem) -> tuple[WindowResult, ...]:
    """Two windows of the control targets as they are."""
    state = initial_state(problem.model, problem.qpos[0], problem.qvel0)
    middle = problem.clock.frames // 2 * problem.clock.stride
    windows = []
    for index, (start, end) in enumerate(((0, middle), (middle, problem.clock.steps))):
        ctrl = problem.targets_rad[start:end]
        states = simulate(problem.model, state, ctrl)
        state = states[-1]
        window = solved(
            Window(index, start, end, end),
            ctrl,
            states,
            loss_terms={"pose": 1.0},
            trace=np.ones(3),
            steps=np.zeros(3, dtype=np.int64),
            evaluations=12,
            seconds=2.0,
            stepping_s=1.5,
        )
        windows.append(window)
    return tuple(windows)


@pytest.fixture(scope="session")
def standing() -> Held:
    """One second of standing upright, arms to the sides."""
    body, plan, scene = person(), plans.read("quick"), Scene()
    qpos = squat(body, np.zeros(31))
    evidence = seen(body, qpos)
    com_m, _ = kinematics.configurations(body, qpos)
    fit = KinematicFit(
        body=body,
        scene=scene,
        camera=evidence.camera,
        times_s=evidence.times_s,
        qpos=qpos,
        com_m=com_m,
        reprojection_px=np.zeros(evidence.scores.shape),
        interpolated=np.zeros(len(qpos), dtype=bool),
        iterations=0,
        loss={},
    )
    clock = schedule.clock(evidence.times_s, 0.01)
    reference = planners.plan("none", fit, evidence, plan)
    problem = problems.pose(fit, reference, evidence, clock, plan)
    return Held(problem, fit, stepped(problem), evidence)


@pytest.fixture(scope="session")
def run() -> Reconstruction:
    """See `reconstructed`."""
    return reconstructed()


def hasty() -> Plan:
    """A plan of two windows that takes a second."""
    quick = plans.read("quick")
    return replace(
        quick,
        window=replace(quick.window, length_s=0.2, overlap_s=0.1, knot_spacing_s=0.1),
        optimiser=replace(quick.optimiser, population=8, generations=3),
        kinematics=replace(quick.kinematics, evaluations=20),
    )


def reconstructed() -> Reconstruction:
    """A squat of 0.3 s, seen at 30 Hz but for one dropped frame, reconstructed in two windows."""
    plan = hasty()
    body = person()
    evidence = seen(body, squat(body, np.linspace(0.0, 0.3, 10)))
    kept = np.delete(np.arange(10), 4)
    assert evidence.camera is not None
    evidence = replace(
        evidence,
        times_s=evidence.times_s[kept],
        keypoints_px=evidence.keypoints_px[kept],
        scores=evidence.scores[kept],
        joints_m=evidence.joints_m[kept],
        camera=cameras.at(evidence.camera, kept),
    )
    return pipeline.reconstruct(evidence, Scene(), plan, pipeline.Setup(seed=3, threads=1))
