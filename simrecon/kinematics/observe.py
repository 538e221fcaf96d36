"""From evidence to what the objective holds the pose against."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon import body as bodies
from simrecon import contact, prior
from simrecon.body import names
from simrecon.contact import Cues
from simrecon.errors import InputError
from simrecon.geometry import camera as cameras
from simrecon.kinematics import world
from simrecon.kinematics.observations import Observations
from simrecon.plan import Kinematics
from simrecon.trust import Trust
from simrecon.types import Array, Camera, Evidence, Skeleton

MIN_SCORE = 0.1


@dataclass(frozen=True, eq=False)
class Points:
    """The evidence by point of the body: (M, T, …), weights zero where nothing is known."""

    pixels: Array
    scores: Array
    joints_m: Array
    known: Array


def by_point(evidence: Evidence, skeleton: Skeleton) -> Points:
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
    return Points(pixels, np.minimum(scores, 1.0), joints, np.minimum(known, 1.0))


def size(evidence: Evidence, skeleton: Skeleton) -> float:
    """Lengths of the skeleton in units of those of the 3D estimate, the median; 1 where none is known."""
    measured, ours = bodies.measure(evidence), bodies.measure_template(skeleton)
    ratios = [ours[key] / measured[key] for key in measured if key in ours]
    return float(np.median(ratios)) if ratios else 1.0


def observe(
    evidence: Evidence,
    skeleton: Skeleton,
    points: Points,
    camera: Camera | None,
    plan: Kinematics,
    worth: Trust,
    size_sigma: float,
) -> Observations:
    """Evidence for the objective: rays, and root-relative joints on world axes at the skeleton's scale.

    Args:
        evidence: as it was read.
        skeleton: unscaled.
        points: the evidence by point of the body.
        camera: with a path, or None.
        plan: scales of the residuals.
        worth: of the source.
        size_sigma: how surely the skeleton's stature is known (natural logarithm).
    """
    in_world = points.joints_m
    if evidence.joints_frame != "world":
        in_world = world.in_world(camera, in_world)
    hips = [skeleton.point_names.index(f"{side}_hip") for side in ("left", "right")]
    has_hips = np.all(points.known[hips] > 0, axis=0).astype(np.float64)  # (T,)
    root_weights = np.zeros(len(skeleton.point_names))
    root_weights[hips] = 0.5
    root = np.tensordot(root_weights, in_world, axes=1)  # (T, 3)
    use_image = bool(evidence.keypoint_names) and camera is not None
    gaussian = prior.gaussian(skeleton)
    focal = cameras.focal_px(camera.lens) if camera is not None else 1.0
    rays = np.zeros_like(points.pixels)
    if use_image and camera is not None:
        rays = np.nan_to_num(cameras.undistort(camera.lens, points.pixels))
    interval = float(evidence.times_s[1] - evidence.times_s[0])

    labels = contact.label(
        Cues(interval, camera, rays, points.scores, in_world, points.known, evidence.joints_frame == "world"),
        plan.contact_model,
    )
    return Observations(
        interval_s=interval,
        rays=rays,
        ray_weights=points.scores if use_image else np.zeros_like(points.scores),
        ray_sigma=plan.keypoint_scale_px / focal,
        world_to_camera=cameras.extrinsics(camera) if use_image and camera is not None else None,
        joints_m=(in_world - root) * (1.0 if worth.metric else size(evidence, skeleton)),
        joint_weights=points.known * has_hips,
        place_m=root,
        place_weights=has_hips * (evidence.joints_frame != "camera_root_relative"),
        root_weights=root_weights,
        labels=labels,
        scale_sigma=size_sigma,
        neutral=gaussian.mean_rad,
        spread=gaussian.spread_rad,
        prior=prior.make(plan.prior_model, skeleton),
        length_sigma=worth.lengths,
        lean_sigma=worth.lean_rad,
        metric=worth.metric,
    )
