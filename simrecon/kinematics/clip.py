"""From evidence to a person, a world and the pose of every frame; no physics yet."""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter1d

from simrecon import body as bodies
from simrecon import camera as cameras
from simrecon import lbfgs, prior, rotations
from simrecon.body import names, primitives, shape, shaped
from simrecon.errors import InputError
from simrecon.evidence import visibility
from simrecon.kinematics import initial, world
from simrecon.kinematics.conditioning import condition
from simrecon.kinematics.objective import (
    SOLE_M,
    SOLE_RANGE_M,
    Objective,
    Observations,
    Variables,
    contact_points,
    to_qpos,
)
from simrecon.plan import Kinematics
from simrecon.types import Array, Body, Camera, Evidence, KinematicFit, Scene, Skeleton

# How far the scale of the skeleton may be off, as a natural logarithm: stature given, metric 3D estimate,
# neither.
SCALE_SIGMA = {"height": 0.01, "world": 0.05, "other": 0.15}
LOG_SCALE_MAX = 0.5
MIN_SCORE = 0.1
# A foot stands if heel and toe move less than this, seen from an assumed distance and smoothed against noise.
STILL_MPS, STILL_SMOOTH_S, DISTANCE_M = 0.4, 0.04, 4.0


@dataclass(frozen=True, eq=False)
class _Points:
    """The evidence by point of the body: (M, T, …), weights zero where nothing is known."""

    pixels: Array
    scores: Array
    joints_m: Array
    known: Array


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
    skeleton, made = _person(evidence, wanted)
    points = _by_point(evidence, skeleton)
    camera = world.provisional(evidence)
    known_world = evidence.camera is not None and evidence.camera.world_to_camera is not None
    floor_only = replace(plan, contact=0.0, penetration=0.0)
    problem = _observe(evidence, skeleton, points, camera, plan)
    contacts = contact_points(skeleton, _primitives(skeleton, evidence, made))
    start, base = _start(evidence, skeleton, problem, camera)

    objective = Objective(skeleton, contacts, scene, base, problem, plan if known_world else floor_only)
    depth_m = 1.0
    if camera is not None:
        depth_m = float(np.median(cameras.to_camera(camera, start.root_m)[:, 2]))
    found, iterations = _minimise(objective, start, plan.evaluations, depth_m)
    if not known_world:
        transform = _floor(objective, found, evidence)
        camera = world.moved(camera, transform)
        problem = _moved(problem, transform, camera)
        base = transform[:3, :3] @ base
        found = replace(found, root_m=found.root_m @ transform[:3, :3].T + transform[:3, 3])
        objective = Objective(skeleton, contacts, scene, base, problem, plan)
        found, more = _minimise(objective, found, plan.evaluations, depth_m)
        iterations += more
    distribution = "standard" if wanted is None else wanted.distribution
    return _result(evidence, scene, camera, objective, found, iterations, made, distribution)


def _person(evidence: Evidence, wanted: bodies.Wanted | None) -> tuple[Skeleton, bodies.Shape | None]:
    """Kinematic tree, and the shape if one is wanted: betas give lengths, or measured lengths the betas."""
    lengths = bodies.measure(evidence)
    measured = bodies.scaled(lengths, evidence.height_m, primitives.default_height_m())
    if wanted is None:
        return measured, None
    if wanted.betas is not None:
        made = shaped.make(wanted.betas, height_m=evidence.height_m, shapes=wanted.shapes)
        return made.skeleton, made
    betas = shape.fit(lengths, height_m=evidence.height_m, mass_kg=evidence.mass_kg, shapes=wanted.shapes)
    height = evidence.height_m or bodies.stature_m(measured)
    return measured, shaped.make(betas, height_m=height, shapes=wanted.shapes)


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


def _by_point(evidence: Evidence, skeleton: Skeleton) -> _Points:
    """Average what the evidence says of each point of the body (some networks name a point twice)."""
    count, frames = len(skeleton.point_names), len(evidence.times_s)
    pixels, scores = np.zeros((count, frames, 2)), np.zeros((count, frames))
    for column, point in enumerate(names.resolve(evidence.keypoint_names)):
        if point != names.IGNORED:
            seen = np.isfinite(evidence.keypoints_px[:, column]).all(axis=-1)
            score = np.where(
                seen & (evidence.scores[:, column] >= MIN_SCORE), evidence.scores[:, column], 0.0
            )
            pixels[point] += score[:, None] * np.nan_to_num(evidence.keypoints_px[:, column])
            scores[point] += score
    joints, known = np.zeros((count, frames, 3)), np.zeros((count, frames))
    for column, point in enumerate(names.resolve(evidence.joint_names)):
        if point != names.IGNORED:
            seen = np.all(np.isfinite(evidence.joints_m[:, column]), axis=-1)
            joints[point] += np.where(seen[:, None], np.nan_to_num(evidence.joints_m[:, column]), 0.0)
            known[point] += seen
    pixels = np.where(scores[..., None] > 0, pixels / np.maximum(scores, 1e-12)[..., None], np.nan)
    joints = joints / np.maximum(known, 1.0)[..., None]
    if not scores.any() and not known.any():
        raise InputError("the evidence names no point of the body that is ever seen")
    return _Points(pixels, np.minimum(scores, 1.0), joints, np.minimum(known, 1.0))


def _observe(
    evidence: Evidence, skeleton: Skeleton, points: _Points, camera: Camera | None, plan: Kinematics
) -> Observations:
    """Evidence for the objective: rays, and root-relative joints on world axes at the skeleton's scale."""
    in_world = points.joints_m
    if evidence.joints_frame != "world":
        transform = world.LEVEL if camera is None else cameras.extrinsics(camera)
        in_world = (in_world - transform[:3, 3]) @ transform[:3, :3]  # (M, T, 3) Rᵀ (x - t), row vectors
    hips = [skeleton.point_names.index(f"{side}_hip") for side in ("left", "right")]
    has_hips = np.all(points.known[hips] > 0, axis=0).astype(np.float64)  # (T,)
    root_weights = np.zeros(len(skeleton.point_names))
    root_weights[hips] = 0.5
    root = np.tensordot(root_weights, in_world, axes=1)  # (T, 3)
    measured, ours = bodies.measure(evidence), bodies.measure_template(skeleton)
    ratios = [ours[key] / measured[key] for key in measured if key in ours]
    use_image = bool(evidence.keypoint_names) and camera is not None
    gaussian = prior.gaussian(skeleton)
    focal = cameras.focal_px(camera) if camera is not None else 1.0
    rays = np.zeros_like(points.pixels)
    if use_image and camera is not None:
        rays = np.nan_to_num(cameras.undistort(camera, points.pixels))
    known_scale = "height" if evidence.height_m else "world" if evidence.joints_frame == "world" else "other"
    return Observations(
        interval_s=float(evidence.times_s[1] - evidence.times_s[0]),
        rays=rays,
        ray_weights=points.scores if use_image else np.zeros_like(points.scores),
        ray_sigma=plan.keypoint_scale_px / focal,
        world_to_camera=cameras.extrinsics(camera) if use_image and camera is not None else None,
        joints_m=(in_world - root) * (float(np.median(ratios)) if ratios else 1.0),
        joint_weights=points.known * has_hips,
        place_m=root,
        place_weights=has_hips * (evidence.joints_frame != "camera_root_relative"),
        root_weights=root_weights,
        standing=_standing(skeleton, rays, points, in_world, evidence, camera),
        scale_sigma=SCALE_SIGMA[known_scale],
        neutral=gaussian.mean_rad,
        spread=gaussian.spread_rad,
        prior=prior.make(plan.prior_model, skeleton),
    )


def _standing(
    skeleton: Skeleton,
    rays: Array,
    points: _Points,
    joints_m: Array,
    evidence: Evidence,
    camera: Camera | None,
) -> Array:
    """How surely each foot stands still (2, T): by the speed of heel and toe in the image, else in 3D."""
    interval = float(evidence.times_s[1] - evidence.times_s[0])
    smooth = STILL_SMOOTH_S / interval
    found = []
    for side in ("left", "right"):
        rows = [skeleton.point_names.index(f"{side}_{end}") for end in ("heel", "toe")]
        in_image = camera is not None and points.scores[rows].any()
        places = rays[rows] * DISTANCE_M if in_image else joints_m[rows]
        known = points.scores[rows] if in_image else points.known[rows]
        if not known.any():
            found.append(np.zeros(places.shape[1]))
            continue
        weight = np.maximum(known, 1e-6)[..., None]
        total = gaussian_filter1d(weight, smooth, axis=1)
        smoothed = gaussian_filter1d(places * weight, smooth, axis=1) / total
        speed = np.linalg.norm(np.gradient(smoothed, interval, axis=1), axis=-1).max(axis=0)  # (T,)
        found.append(np.exp(-((speed / STILL_MPS) ** 2)))
    return np.stack(found)


def _start(
    evidence: Evidence, skeleton: Skeleton, problem: Observations, camera: Camera | None
) -> tuple[Variables, Array]:
    """Variables to begin with and the root orientation from which its rotation vector is counted."""
    base = initial.root_orientation(skeleton, problem.joints_m, problem.joint_weights)
    frames = len(evidence.times_s)
    if problem.world_to_camera is not None and camera is not None:
        both = problem.ray_weights * problem.joint_weights
        smooth = 0.2 / problem.interval_s
        if not both.any():
            base, problem_joints = _facing_camera(camera, skeleton, frames)
            root = initial.root_position(problem.rays, problem.ray_weights, problem_joints, camera, smooth)
        else:
            root = initial.root_position(problem.rays, both, problem.joints_m, camera, smooth)
    else:
        root = initial.filled(problem.place_m, problem.place_weights > 0)
    rotvecs = initial.limb_rotations(skeleton, base, problem.joints_m, problem.joint_weights, problem.neutral)
    return Variables(root, rotvecs, 0.0, SOLE_M), base


def _facing_camera(camera: Camera, skeleton: Skeleton, frames: int) -> tuple[Array, Array]:
    """Without any 3D estimate: a person who stands upright and faces the camera, relaxed."""
    forward = -cameras.extrinsics(camera)[2, :3]
    yaw = float(np.arctan2(forward[1], forward[0]))
    base = np.broadcast_to(rotations.matrix(rotations.exp(np.array([0.0, 0.0, yaw]))), (frames, 3, 3))
    offsets = bodies.t_pose_m(skeleton)[skeleton.point_segments] + skeleton.point_offsets_m  # (M, 3)
    return base, np.broadcast_to((base[0] @ offsets.T).T[:, None], (len(offsets), frames, 3))


def _minimise(
    objective: Objective, start: Variables, evaluations: int, depth_m: float
) -> tuple[Variables, int]:
    """Minimise in variables that all matter alike; scale and sole stay within their ranges."""
    better = condition(objective, depth_m)
    x0 = better.from_variables(start.pack())
    lower, upper = np.full_like(x0, -np.inf), np.full_like(x0, np.inf)
    lower[-2:] = np.array([-LOG_SCALE_MAX, SOLE_RANGE_M[0]]) / better.shared
    upper[-2:] = np.array([LOG_SCALE_MAX, SOLE_RANGE_M[1]]) / better.shared

    def scaled(u: Array) -> tuple[float, Array]:
        loss, gradient = objective(better.to_variables(u))
        return loss, better.gradient(gradient)

    found = lbfgs.minimize(
        scaled, x0, max_evaluations=evaluations, ftol_rel=1e-6, lower=lower, upper=upper, memory=20
    )
    return Variables.unpack(better.to_variables(found.x), len(start.root_m)), found.evaluations


def _floor(objective: Objective, found: Variables, evidence: Evidence) -> Array:
    """Transform that brings the floor under the lowest foot points to the scene's ground."""
    pose = objective.pose(found)
    skeleton = objective.skeleton
    feet = [i for i, name in enumerate(skeleton.point_names) if name.endswith(("_heel", "_toe"))]
    scale = float(np.exp(found.log_scale))
    offsets = (scale * skeleton.point_offsets_m + found.sole_m * objective.drop)[feet]
    places = pose.origins_m[skeleton.point_segments[feet]] + np.einsum(
        "gtij,gj->gti", pose.axes[skeleton.point_segments[feet]], offsets
    )
    transform = world.floor_transform(places, tilt=evidence.joints_frame != "world")
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
    skeleton = bodies.rescaled(objective.skeleton, scale)
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
