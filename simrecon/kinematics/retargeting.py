"""A fitted motion on another body (Rempe 2020, appendix D).

The landmarks of the motion, uniformly scaled to the size of the other body, are what its joint angles are
solved for, and what touched floor or things before touches them again and does not slide (eq. B6, B7). The
solver is that of the kinematic fit: all frames at once, L-BFGS, analytic gradients.

Size is that of the legs. On bare ground the way that the person goes scales too. Things of a scene don't
scale with a person, so among them the way is kept, and heights scale from what the person stands on.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.ndimage import gaussian_filter1d

from simrecon import prior
from simrecon import scene as scenes
from simrecon.body import known
from simrecon.geometry import rotations
from simrecon.kinematics import forward, initial, search, terms
from simrecon.kinematics.contacts import ContactPoints, contact_points
from simrecon.kinematics.curvature import curvature
from simrecon.kinematics.fitting import configurations
from simrecon.kinematics.objective import Objective, Observations
from simrecon.kinematics.variables import Variables, to_qpos
from simrecon.plan import Kinematics
from simrecon.system import blas
from simrecon.types import Array, Body, KinematicFit, Scene, Skeleton

# A point touches what is nearer than this, or no deeper than that; it is held if it is slower than this.
TOUCH_M, SUNK_M, SLOW_MPS = 0.02, 0.05, 0.2
# What touched keeps its distance, what was held stays: firmly, against landmarks with a scale of 10 cm.
SIGMA_CLEARANCE_M, SIGMA_HELD_MPS = 0.005, 0.05
# The scaled way is no estimate, so it counts for more than the place of evidence does.
PLACE_SCALE_M = 0.03
# Landmarks say little of how a straight limb is twisted: joints stay near their angles.
SIGMA_TURN_RAD = 0.5
# Supports are steps in height; a pelvis takes them smoothly.
SUPPORT_SMOOTH_S = 0.2
LEVEL_COSINE = 0.7


@dataclass(frozen=True, eq=False)
class Contacts:
    """What a motion touches; S things, the ground first, G contact points.

    Attributes:
        clearance_m: (S, G, T) signed distance, negative inside.
        touching: (S, G, T) how surely a point touches a thing, 0 to 1.
        held: (G, T - 1) how surely a point rests on something from a frame to the next, 0 to 1.
        support_m: (T,) height of what the person rests on, interpolated where that is nothing.
    """

    clearance_m: Array
    touching: Array
    held: Array
    support_m: Array


@blas.one_thread()
def retarget(fit: KinematicFit, body: Body, weights: Kinematics) -> KinematicFit:
    """Put a motion on another body.

    Args:
        fit: the motion, on uniform frames.
        body: the other body.
        weights: of the objective; evidence has no share in it.

    Returns:
        The motion of `body`, in the same scene and world; reprojection errors are NaN.
    """
    objective, start = problem(fit, body, weights)
    solved, used = search.minimise(
        objective,
        partial(curvature, objective.objective),  # without the terms of the contacts
        start,
        weights.evaluations,
        settled=1e-4,
        shared=False,
    )
    objective(solved.pack())
    qpos = to_qpos(solved.root_m, objective.objective.base, solved.rotvecs)
    return replace(
        fit,
        body=body,
        qpos=qpos,
        com_m=configurations(body, qpos)[0],
        reprojection_px=np.full_like(fit.reprojection_px, np.nan),
        iterations=used,
        loss=dict(objective.terms),
    )


def scale_of(fit: KinematicFit, body: Body) -> float:
    """Factor by which a motion is scaled for another body: the ratio of leg lengths."""
    return known.leg_m(body.skeleton) / known.leg_m(fit.body.skeleton)


class Retargeting:
    """Objective of a motion on another body; called with the packed variables, it returns loss and gradient.

    E = E_fit + Δt Σ_t (Σ a (d - d̂)² / σ_d² + Σ b ‖ẋ‖² / σ_v² + Σ ‖v - v̂‖² / σ_r²) with the kinematic
    objective E_fit of scaled landmarks, clearances d of what touches (weights a), velocities ẋ of contact
    points at rest (b), and rotation vectors v. The body is given: its scale, sole and
    lengths don't move.
    """

    def __init__(self, objective: Objective, contacts: Contacts, scale: float, rotvecs: Array) -> None:
        """Hold the problem; `contacts` and `rotvecs` (17, T, 3) are those of the motion before."""
        self.objective, self.contacts, self.rotvecs = objective, contacts, rotvecs
        self.clearance_m = scale * np.maximum(contacts.clearance_m, 0.0)  # as near as before, never inside
        self.terms: dict[str, float] = {}

    def __call__(self, x: Array) -> tuple[float, Array]:
        """Loss and gradient (n,) at the packed variables x (n,)."""
        own, dt = self.objective, self.objective.observations.interval_s
        loss, gradient = own(x)
        variables = Variables.unpack(x, len(own.base), len(own.stretch))
        pose = own.pose(variables)
        points = forward.points(pose, own.contacts.segments, own.contacts.offsets_m)  # (G, T, 3)
        apart, normals = scenes.distances(own.scene, points)  # (S, G, T), (S, G, T, 3)
        touch, slope = terms.near(
            apart - own.contacts.radii_m[:, None],
            self.clearance_m,
            self.contacts.touching,
            SIGMA_CLEARANCE_M,
        )
        hold, d_points = terms.held(points, self.contacts.held, dt, SIGMA_HELD_MPS)
        turn, d_rotvecs = terms.near(variables.rotvecs, self.rotvecs, 1.0, SIGMA_TURN_RAD)
        d_points += np.einsum("sgt,sgti->gti", slope, normals)
        force, d_joints = forward.adjoint(own.skeleton, pose, own.contacts.segments, points, d_points)
        more = {"touch": dt * touch, "hold": dt * hold, "turn": dt * turn}
        self.terms = {**own.terms, **more}
        moved = dt * np.concatenate((force[0].ravel(), (d_joints + d_rotvecs).ravel()))
        gradient[: len(moved)] += moved
        gradient[len(moved) :] = 0.0
        return loss + sum(more.values()), gradient


def problem(fit: KinematicFit, body: Body, weights: Kinematics) -> tuple[Retargeting, Variables]:
    """The objective of `retarget`, and the scaled motion with the joint angles of before."""
    root, base = fit.qpos[:, :3], rotations.matrix(fit.qpos[:, 3:7])
    rotvecs = np.zeros((len(fit.body.skeleton.names), len(root), 3))
    rotvecs[1:] = np.swapaxes(rotations.log(fit.qpos[:, 7:].reshape(len(root), -1, 4)), 0, 1)
    before = fit.body.skeleton
    pose = forward.forward(before, root, base, rotvecs, 1.0)
    marks = forward.points(pose, before.point_segments, before.point_offsets_m)  # (M, T, 3)
    interval_s = float(fit.times_s[1] - fit.times_s[0])
    found = contacts(fit.scene, contact_points(before, fit.body.primitives), pose, interval_s)
    scale = scale_of(fit, body)
    touch = contact_points(body.skeleton, body.primitives)
    see = _observe(body.skeleton, touch, marks, found, fit.scene, scale, interval_s, weights)
    place = scaled_places(fit.scene, root, found.support_m, scale)
    # the motion before has met these; they would only move it once more
    chosen = replace(weights, keypoint=0.0, contact=0.0, still=0.0, balance=0.0, smooth_com=0.0, prior=0.0)
    chosen = replace(chosen, travel_position=0.0, travel_rotation=0.0)
    chosen = replace(chosen, place_scale_m=PLACE_SCALE_M)
    objective = Objective(body.skeleton, touch, fit.scene, base, see, chosen)
    still = np.zeros((objective.leans.shape[1], 3))
    start = Variables(place, rotvecs, 0.0, 0.0, np.zeros(len(objective.stretch)), still)
    return Retargeting(objective, found, scale, rotvecs), start


def contacts(scene: Scene, touch: ContactPoints, pose: forward.Pose, interval_s: float) -> Contacts:
    """Which points of a posed body touch what, and which of them rest there."""
    points = forward.points(pose, touch.segments, touch.offsets_m)  # (G, T, 3)
    apart, normals = scenes.distances(scene, points)
    clearance = apart - touch.radii_m[:, None]
    touching = np.exp(-((clearance / np.where(clearance > 0, TOUCH_M, SUNK_M)) ** 2))
    speed = np.linalg.norm(np.diff(points, axis=1), axis=-1) / interval_s  # (G, T - 1)
    surely = touching.max(axis=0)  # (G, T)
    held = np.exp(-((speed / SLOW_MPS) ** 2)) * np.minimum(surely[:, 1:], surely[:, :-1])
    weight = np.where(normals[..., 2] > LEVEL_COSINE, touching, 0.0)  # (S, G, T)
    total = weight.sum(axis=(0, 1))
    height = np.sum(weight * (points[..., 2] - apart * normals[..., 2]), axis=(0, 1)) / np.maximum(
        total, 1e-9
    )
    filled = initial.filled(height[:, None], total > 0.5)
    smooth = gaussian_filter1d(filled[:, 0], SUPPORT_SMOOTH_S / interval_s, mode="nearest")
    return Contacts(clearance, touching, held, smooth)


def scaled_places(scene: Scene, places_m: Array, support_m: Array, scale: float) -> Array:
    """Where places (T, 3) of a scaled person are, given the heights (T,) on which the person rests.

    On bare ground all is scaled about the ground under the first place. Among things only heights are, over
    the support.
    """
    if scene.items:
        above = places_m[:, 2] - support_m
        return np.column_stack((places_m[:, :2], support_m + scale * above))
    centre = places_m[0].copy()
    centre[2] = scenes.support_height(scene, centre[None, :2])[0]
    scaled: Array = centre + scale * (places_m - centre)
    return scaled


def _observe(
    skeleton: Skeleton,
    touch: ContactPoints,
    marks_m: Array,
    found: Contacts,
    scene: Scene,
    scale: float,
    interval_s: float,
    weights: Kinematics,
) -> Observations:
    """The scaled landmarks (M, T, 3) as what the objective holds the pose against."""
    count, frames = marks_m.shape[:2]
    roots = np.zeros(count)
    roots[[skeleton.point_names.index(f"{side}_hip") for side in ("left", "right")]] = 0.5
    root = np.tensordot(roots, marks_m, axes=1)  # (T, 3)
    gaussian = prior.gaussian(skeleton)
    standing = found.held[touch.soles].mean(axis=1)  # (2, T - 1)
    sitting = found.held[touch.seat].max(axis=(0, 1))  # (T - 1,)
    return Observations(
        interval_s=interval_s,
        rays=np.zeros((count, frames, 2)),
        ray_weights=np.zeros((count, frames)),
        ray_sigma=1.0,
        world_to_camera=None,
        joints_m=scale * (marks_m - root),
        joint_weights=np.ones((count, frames)),
        place_m=scaled_places(scene, root, found.support_m, scale),
        place_weights=np.ones(frames),
        root_weights=roots,
        standing=np.concatenate((standing[:, :1], standing), axis=1),
        sitting=np.append(sitting[:1], sitting),
        scale_sigma=1.0,
        neutral=gaussian.mean_rad,
        spread=gaussian.spread_rad,
        prior=prior.make(weights.prior_model, skeleton),
    )
