"""From evidence to a person, a world and the pose of every frame; no physics yet."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import mujoco
import numpy as np

from simrecon import body as bodies
from simrecon.body import names, primitives, shape, shaped
from simrecon.evidence import visibility
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.kinematics import forward, ground, initial, search, world
from simrecon.kinematics.contacts import contact_points
from simrecon.kinematics.curvature import curvature
from simrecon.kinematics.objective import SOLE_M, Objective, Observations
from simrecon.kinematics.observe import by_point, observe
from simrecon.kinematics.variables import Variables, leans, to_qpos
from simrecon.plan import Kinematics
from simrecon.system import blas
from simrecon.types import Array, Body, Camera, Evidence, IntArray, KinematicFit, Scene, Skeleton

FLOOR_FRAMES = 120  # spread over the clip, which are enough for a plane


@blas.one_thread()
def fit(
    evidence: Evidence, scene: Scene, plan: Kinematics, wanted: bodies.Wanted | None = None
) -> KinematicFit:
    """Fit shape scale, root and joint angles of all frames to the evidence.

    Args:
        evidence: on a uniform time grid.
        scene: what the person may touch, in the world of the camera's extrinsics where those are given.
        plan: weights and scales.
        wanted: the body's shape; None: primitives by the proportions of `models/body/primitives.toml`.

    Raises:
        InputError: nothing in the evidence can be used, or no such shape.
    """
    skeleton, made = _person(evidence, wanted, plan)
    points = by_point(evidence, skeleton)
    camera = world.provisional(evidence)
    known_world = evidence.ground_known and evidence.camera is not None and evidence.camera.path is not None
    plan = _switched(plan)
    problem = observe(evidence, skeleton, points, camera, plan)
    parts = _primitives(skeleton, evidence, made)
    contacts = contact_points(skeleton, parts)
    free = plan.shape and (wanted is None or wanted.betas is None)  # whether lengths are unknowns
    found, base = _start(evidence, skeleton, problem, camera, len(bodies.length_names()) if free else 0)

    weights = plan if known_world else replace(plan, contact=0.0, penetration=0.0, balance=0.0)
    objective = Objective(skeleton, contacts, scene, base, problem, weights, lengths=free)
    found, iterations = _minimise(objective, found, plan)
    if not known_world:
        transform = _floor(objective, found, evidence, parts)
        camera = world.moved(camera, transform)
        problem = _moved(problem, transform, camera)
        base = transform[:3, :3] @ base
        found = replace(found, root_m=found.root_m @ transform[:3, :3].T + transform[:3, 3])
        objective = Objective(skeleton, contacts, scene, base, problem, plan, lengths=free)
        found, more = _minimise(objective, found, plan)
        iterations += more
    distribution = "standard" if wanted is None else wanted.distribution
    return _result(evidence, scene, camera, objective, found, iterations, made, distribution)


def _switched(plan: Kinematics) -> Kinematics:
    """Weights of zero where a letter of the ablation is off."""
    if not plan.ground:
        plan = replace(plan, penetration=0.0, contact=0.0, balance=0.0)
    if not plan.temporal:
        plan = replace(plan, smooth_com=0.0, smooth_position=0.0, smooth_rotation=0.0, still=0.0)
        plan = replace(plan, travel_position=0.0, travel_rotation=0.0)
    return plan


def _person(
    evidence: Evidence, wanted: bodies.Wanted | None, plan: Kinematics
) -> tuple[Skeleton, bodies.Shape | None]:
    """Kinematic tree, and the shape if one is wanted: betas give lengths, or measured lengths the betas."""
    lengths = bodies.measure(evidence, _seeds(evidence, plan.seed_frames)) if plan.shape else {}
    measured = bodies.scaled(lengths, evidence.height_m, primitives.default_height_m())
    if wanted is None:
        return measured, None
    if wanted.betas is not None:
        made = shaped.make(wanted.betas, height_m=evidence.height_m, shapes=wanted.shapes)
        return made.skeleton, made
    betas = shape.fit(lengths, height_m=evidence.height_m, mass_kg=evidence.mass_kg, shapes=wanted.shapes)
    height = evidence.height_m or bodies.stature_m(measured)
    return measured, shaped.make(betas, height_m=height, shapes=wanted.shapes)


def _seeds(evidence: Evidence, count: int) -> IntArray | None:
    """The frames with the best landmark scores on average (Gärtner 2022, section 3.4); None: all."""
    if not count or not evidence.keypoint_names:
        return None
    there = np.asarray(np.isfinite(evidence.joints_m).all(axis=2))  # (T, K)
    known = there[:, there.any(axis=0)].all(axis=1)
    mean = np.where(known, evidence.scores.mean(axis=1), -1.0)
    return np.sort(np.argsort(-mean, kind="stable")[:count])


def _primitives(
    skeleton: Skeleton, evidence: Evidence, made: bodies.Shape | None
) -> tuple[bodies.Primitive, ...]:
    height, mass = _stature_and_mass(skeleton, evidence)
    if made is None:
        return primitives.make(skeleton, height, mass, 0.0)
    return shaped.primitives(made, skeleton, height_m=made.height_m, mass_kg=mass)


def _stature_and_mass(skeleton: Skeleton, evidence: Evidence) -> tuple[float, float]:
    height = evidence.height_m or bodies.stature_m(skeleton)
    return height, evidence.mass_kg or primitives.default_mass_kg(height)


def _start(
    evidence: Evidence, skeleton: Skeleton, problem: Observations, camera: Camera | None, lengths: int
) -> tuple[Variables, Array]:
    """Variables to begin with, and the root orientation from which its rotation vector is counted."""
    base = initial.root_orientation(skeleton, problem.joints_m, problem.joint_weights)
    frames = len(evidence.times_s)
    if problem.world_to_camera is not None and camera is not None:
        both = problem.ray_weights * problem.joint_weights
        smooth = 0.2 / problem.interval_s
        if not both.any():
            base, problem_joints = _facing_camera(camera, skeleton)
            root = initial.root_position(problem.rays, problem.ray_weights, problem_joints, camera, smooth)
        else:
            root = initial.root_position(problem.rays, both, problem.joints_m, camera, smooth)
    else:
        root = initial.filled(problem.place_m, problem.place_weights > 0)
    rotvecs = initial.limb_rotations(skeleton, base, problem.joints_m, problem.joint_weights, problem.neutral)
    lean = np.zeros((leans(frames, problem.interval_s).shape[1], 3))
    return Variables(root, rotvecs, 0.0, SOLE_M, np.zeros(lengths), lean), base


def _facing_camera(camera: Camera, skeleton: Skeleton) -> tuple[Array, Array]:
    """Without any 3D estimate: a person who stands upright and faces the camera, relaxed."""
    forward = -cameras.extrinsics(camera)[:, 2, :3]  # (T, 3)
    yaw, level = np.arctan2(forward[:, 1], forward[:, 0]), np.zeros(len(forward))
    base = rotations.matrix(rotations.exp(np.stack((level, level, yaw), axis=-1)))  # (T, 3, 3)
    offsets = bodies.t_pose_m(skeleton)[skeleton.point_segments] + skeleton.point_offsets_m  # (M, 3)
    return base, np.moveaxis(base @ offsets.T, 2, 0)  # (M, T, 3)


def _minimise(objective: Objective, start: Variables, plan: Kinematics) -> tuple[Variables, int]:
    """Without poses to optimise the start is the end."""
    return search.minimise(
        objective, partial(curvature, objective), start, plan.evaluations if plan.poses else 0
    )


def _floor(
    objective: Objective, found: Variables, evidence: Evidence, parts: tuple[bodies.Primitive, ...]
) -> Array:
    """Transform that brings the ground under the person to the scene's (Gärtner 2022, eq. 7)."""
    frames = len(found.root_m)
    rows = np.unique(np.linspace(0, frames - 1, min(frames, FLOOR_FRAMES)).round().astype(int))
    pose, scale = objective.pose(found), float(np.exp(found.log_scale))
    skin = ground.skin(objective.skeleton, parts, forward.at(pose, rows), scale, found.sole_m)
    transform = ground.transform(*skin, tilt=evidence.joints_frame != "world")
    transform[2, 3] += objective.scene.ground.height_m
    return transform


def _moved(problem: Observations, transform: Array, camera: Camera | None) -> Observations:
    rotation = transform[:3, :3]
    return replace(
        problem,
        joints_m=problem.joints_m @ rotation.T,
        place_m=problem.place_m @ rotation.T + transform[:3, 3],
        world_to_camera=None
        if problem.world_to_camera is None or camera is None
        else cameras.extrinsics(camera),
    )


def _result(
    evidence: Evidence,
    scene: Scene,
    camera: Camera | None,
    objective: Objective,
    found: Variables,
    iterations: int,
    made: bodies.Shape | None,
    distribution: str,
) -> KinematicFit:
    """Build the body at the fitted scale and read the centre of mass and reprojection errors off it."""
    scale = float(np.exp(found.log_scale))
    skeleton = bodies.rescaled(objective.person(found), scale)
    skeleton = replace(skeleton, point_offsets_m=skeleton.point_offsets_m + found.sole_m * objective.drop)
    height, mass = _stature_and_mass(skeleton, evidence)
    if made is not None:
        height = made.height_m * scale
        mass = evidence.mass_kg or made.mass_kg * scale**3
    person = bodies.build(
        skeleton,
        height_m=height,
        mass_kg=mass,
        betas=None if made is None else made.betas,
        shapes=None if made is None else made.shapes,
        distribution=distribution,
    )
    qpos = to_qpos(found.root_m, objective.base, found.rotvecs)
    com, marks = configurations(person, qpos)
    reprojection = np.full(evidence.scores.shape, np.nan)
    if evidence.keypoint_names and camera is not None:
        where = names.resolve(evidence.keypoint_names)
        known = where != names.IGNORED
        projected = cameras.project(camera, marks[:, where[known]])
        reprojection[:, known] = np.linalg.norm(projected - evidence.keypoints_px[:, known], axis=-1)
    objective(found.pack())
    return KinematicFit(
        body=person,
        scene=scene,
        camera=camera,
        times_s=evidence.times_s,
        qpos=qpos,
        com_m=com,
        reprojection_px=reprojection,
        interpolated=~visibility(evidence),
        iterations=iterations,
        loss=dict(objective.terms),
    )


def configurations(person: Body, qpos: Array) -> tuple[Array, Array]:
    """Centre of mass (T, 3) and landmark points (T, M, 3) of configurations qpos (T, nq), m."""
    model = mujoco.MjModel.from_xml_string(person.mjcf)
    data = mujoco.MjData(model)
    com, marks = np.empty((len(qpos), 3)), np.empty((len(qpos), model.nsite, 3))
    for frame, configuration in enumerate(qpos):
        data.qpos[:] = configuration
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        com[frame], marks[frame] = data.subtree_com[1], data.site_xpos
    return com, marks[:, _site_rows(model, person.skeleton)]


def _site_rows(model: mujoco.MjModel, skeleton: Skeleton) -> list[int]:
    return [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, name) for name in skeleton.point_names]
