"""What every engine works on: the model, the time grid, and the targets of the loss by frame."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter1d

from simrecon import kinematics, prior
from simrecon import scene as scenes
from simrecon.body import names, strength
from simrecon.contact.parts import SIDES
from simrecon.engines import feedforward, momentum
from simrecon.engines.borne import Borne, borne
from simrecon.engines.wished import Wished, wished
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations, splines
from simrecon.plan import Plan
from simrecon.prior import Prior
from simrecon.schedule import Clock
from simrecon.sim.address import locate, with_items_at_rest
from simrecon.sim.models import compile_text
from simrecon.types import Array, Evidence, IntArray, KinematicFit, Reference, Window

MIN_SCORE = 0.1
FEET = tuple(f"{side}_ankle" for side in SIDES)
"""Segments of the feet."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A clip ready for optimisation; T frames, M points of the body, N simulation steps.

    Attributes:
        model: body and scene, compiled from `mjcf`; mjcf: the text that is saved.
        clock: frames and steps. plan: settings. prior: on poses.
        interval_s: between the frames that the loss looks at, every `every`-th one.
        qpos: (T, nq) the reference, movable items at rest; qvel0: (nv,) velocity at the first frame.
        targets_rad: (N + 1, nu) control targets that follow the kinematic pose.
        draft_rad: (Q, nu) knots to begin with where the window before has none; zero if not drafted.
        orientations: (T, 17, 4) root and joint quaternions; com_m: (T, 3); points_m: (T, M, 3).
        point_weights: (M,) in the loss; point_rows: (M,) their sites in the model.
        planted: (T, M) how surely each point belongs to a foot that stands.
        wished: where points are by the user's wishes of contact, or None.
        rays: (T, M, 2); scores: (T, M), zero where not seen; world_to_camera: (T, 4, 4) or None.
        joint_rows: rows of the points that are joint centres.
        limits_rad: (16, 3, 2).
        pushed: (T, 2, 6) moment about the world's origin, and force, that the plan has act on each foot; None
            where the planner knows no forces.
        borne: what segments are to bear of which a user wishes that a part touches, or None.
    """

    model: mujoco.MjModel
    mjcf: str
    clock: Clock
    plan: Plan
    prior: Prior
    every: int
    qpos: Array
    qvel0: Array
    targets_rad: Array
    draft_rad: Array
    orientations: Array
    com_m: Array
    points_m: Array
    point_weights: Array
    point_rows: IntArray
    planted: Array
    wished: Wished | None
    rays: Array
    scores: Array
    world_to_camera: Array | None
    joint_rows: IntArray
    limits_rad: Array
    pushed: Array | None = None
    borne: Borne | None = None

    @property
    def felt(self) -> tuple[str, ...]:
        """K segments whose contacts the loss may look at, the feet first."""
        return FEET + tuple(s for s in (self.borne.segments if self.borne else ()) if s not in FEET)

    @property
    def interval_s(self) -> float:
        """Between the frames that the loss looks at."""
        return self.every * self.clock.frame_s

    def frames(self, window: Window) -> IntArray:
        """Frames of a window that the loss looks at: its first one, every `every`-th, and its last."""
        first, last = (step // self.clock.stride for step in (window.start_step, window.end_step))
        inner = np.arange(first, last, self.every)
        return np.append(inner, last)


def mjcf(fit: KinematicFit, clock: Clock, plan: Plan) -> str:
    """Text of the model that is simulated: the person, as strong as the plan says, in the scene."""
    return scenes.build(
        strength.strengthened(fit.body.mjcf, plan.simulation.strength), fit.scene, clock.step_s
    )


def pose(fit: KinematicFit, reference: Reference, evidence: Evidence, clock: Clock, plan: Plan) -> Problem:
    """Lay out a clip for the engines.

    Args:
        fit: body, scene and camera, on uniform frames.
        reference: what the simulation is to follow, on the same frames.
        evidence: on the same frames.
        clock: frames and steps.
        plan: settings.
    """
    text = mjcf(fit, clock, plan)
    model = compile_text(text)
    skeleton = fit.body.skeleton
    qpos = with_items_at_rest(model, reference.qpos)
    points_m = kinematics.configurations(fit.body, reference.qpos)[1]
    rays, scores = _observations(fit, evidence)
    return Problem(
        model=model,
        mjcf=text,
        clock=clock,
        plan=plan,
        prior=prior.make(plan.loss.prior_model, skeleton),
        every=max(1, round(1 / (plan.loss.rate_hz * clock.frame_s))),
        qpos=qpos,
        qvel0=momentum.first_velocity(model, qpos, clock.frame_s),
        targets_rad=_targets(model, reference.qpos, clock, feedforward.torques(model, qpos, reference)),
        draft_rad=_no_draft(model, clock, plan),
        orientations=reference.qpos[:, 3:].reshape(len(qpos), -1, 4),
        com_m=reference.com_m,
        points_m=points_m,
        point_weights=names.point_weights(),
        point_rows=locate(model).sites(model, skeleton.point_names),
        planted=_planted(fit),
        wished=wished(fit, reference.qpos, points_m),
        rays=rays,
        scores=scores,
        world_to_camera=_camera_path(fit),
        joint_rows=np.flatnonzero(np.linalg.norm(skeleton.point_offsets_m, axis=1) == 0),
        limits_rad=skeleton.limits_rad,
        pushed=_pushed(reference),
        borne=borne(fit, reference),
    )


def _planted(fit: KinematicFit) -> Array:
    """How surely each point of the body belongs to a part of a foot that stands, (T, M)."""
    points = fit.body.skeleton.point_names
    planted = np.zeros((len(fit.qpos), len(points)))
    if fit.contacts is not None:
        for side in SIDES:
            heel, toe = (np.nan_to_num(fit.contacts.of(f"{side}_{end}")) for end in ("heel", "toe"))
            for point, sure in (("ankle", heel * toe), ("heel", heel), ("mtp", toe), ("toe", toe)):
                planted[:, points.index(f"{side}_{point}")] = sure
    return planted


def _pushed(reference: Reference) -> Array | None:
    """What the plan has act on the feet, (T, 2, 6): moment about the world's origin, and force."""
    force, place = reference.contact_force_N, reference.contact_place_m
    if force is None or place is None:
        return None
    on = np.array([[segment == foot for segment in reference.contact_segments] for foot in FEET], float)
    return on @ np.concatenate((np.cross(place, force), force), axis=-1)


def _no_draft(model: mujoco.MjModel, clock: Clock, plan: Plan) -> Array:
    """Knots of the whole clip (Q, nu), zero."""
    duration_s = clock.steps * clock.step_s
    return np.zeros((splines.knot_count(duration_s, plan.window.knot_spacing_s), model.nu))


def _camera_path(fit: KinematicFit) -> Array | None:
    """The world-to-camera transform at each frame, (T, 4, 4); None without a camera."""
    if fit.camera is None:
        return None
    return cameras.extrinsics(fit.camera)


def _targets(model: mujoco.MjModel, qpos: Array, clock: Clock, torques: Array | None) -> Array:
    """Control targets (N + 1, nu): the kinematic pose ahead by the servo's lag, as rotation vectors.

    A PD servo with gains k and d that is told q + (d/k) q̇ + τ/k follows q without lag, if q takes torques τ
    (T, nu); these are None where the planner knows no forces.
    """
    joints = qpos[:, 7:].reshape(len(qpos), -1, 4)
    frames_s = np.arange(len(qpos), dtype=np.float64) * clock.frame_s
    steps_s = np.arange(clock.steps + 1, dtype=np.float64) * clock.step_s
    between = rotations.interpolate(frames_s, joints, steps_s)  # (N + 1, 16, 4)
    rotvecs = rotations.log(between).reshape(len(steps_s), -1)  # (N + 1, nu)
    lag_s = -model.actuator_biasprm[:, 2] / model.actuator_gainprm[:, 0]  # (nu,)
    smooth = gaussian_filter1d(rotvecs, 0.02 / clock.step_s, axis=0, mode="nearest")
    rates = np.gradient(smooth, clock.step_s, axis=0)
    low, high = model.actuator_ctrlrange.T
    ahead = lag_s * rates
    if torques is not None:
        lift = torques / model.actuator_gainprm[:, 0]
        ahead += np.stack([np.interp(steps_s, frames_s, column) for column in lift.T], axis=1)
    targets: Array = np.clip(rotvecs + ahead, low, high)
    return targets


def _observations(fit: KinematicFit, evidence: Evidence) -> tuple[Array, Array]:
    """Rays (T, M, 2) and scores (T, M) by point of the body."""
    shape = (len(evidence.times_s), len(fit.body.skeleton.point_names))
    rays, scores = np.zeros((*shape, 2)), np.zeros(shape)
    if fit.camera is None or not evidence.keypoint_names:
        return rays, scores
    ideal = cameras.undistort(fit.camera.lens, evidence.keypoints_px)  # (T, J, 2)
    for column, point in enumerate(names.resolve(evidence.keypoint_names)):
        if point != names.IGNORED:
            score = np.where(np.isfinite(ideal[:, column]).all(axis=-1), evidence.scores[:, column], 0.0)
            score = np.where(score >= MIN_SCORE, score, 0.0)
            rays[:, point] += score[:, None] * np.nan_to_num(ideal[:, column])
            scores[:, point] += score
    rays /= np.maximum(scores, 1e-12)[..., None]
    return rays, np.minimum(scores, 1.0)
