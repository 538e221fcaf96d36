"""From evidence to what the objective holds the pose against."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from simrecon import body as bodies
from simrecon import prior
from simrecon.body import names
from simrecon.errors import InputError
from simrecon.geometry import camera as cameras
from simrecon.kinematics import world
from simrecon.kinematics.observations import Observations
from simrecon.plan import Kinematics
from simrecon.trust import Trust
from simrecon.types import Array, Camera, Evidence, Skeleton

MIN_SCORE = 0.1
FOOT = ("heel", "toe", "mtp")
# A foot stands if heel and toe move less than this, and hips rest if they do, seen from an assumed distance
# and smoothed against noise.
STILL_MPS, STILL_SMOOTH_S, DISTANCE_M = 0.4, 0.04, 4.0


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
    measured, ours = bodies.measure(evidence), bodies.measure_template(skeleton)
    ratios = [ours[key] / measured[key] for key in measured if key in ours]
    use_image = bool(evidence.keypoint_names) and camera is not None
    gaussian = prior.gaussian(skeleton)
    focal = cameras.focal_px(camera.lens) if camera is not None else 1.0
    rays = np.zeros_like(points.pixels)
    if use_image and camera is not None:
        rays = np.nan_to_num(cameras.undistort(camera.lens, points.pixels))
    interval = float(evidence.times_s[1] - evidence.times_s[0])

    def resting(*names: str) -> Array:
        rows = [skeleton.point_names.index(name) for name in names]
        # in the image, else in 3D
        if camera is not None and points.scores[rows].any():
            places = _at_a_distance(
                camera, rays[rows], in_world if evidence.joints_frame == "world" else None
            )
            return _resting(places, points.scores[rows], interval)
        return _resting(in_world[rows], points.known[rows], interval)

    return Observations(
        interval_s=interval,
        rays=rays,
        ray_weights=points.scores if use_image else np.zeros_like(points.scores),
        ray_sigma=plan.keypoint_scale_px / focal,
        world_to_camera=cameras.extrinsics(camera) if use_image and camera is not None else None,
        joints_m=(in_world - root) * (float(np.median(ratios)) if ratios and not worth.metric else 1.0),
        joint_weights=points.known * has_hips,
        place_m=root,
        place_weights=has_hips * (evidence.joints_frame != "camera_root_relative"),
        root_weights=root_weights,
        standing=np.stack([resting(*(f"{side}_{end}" for end in FOOT)) for side in ("left", "right")]),
        sitting=resting("left_hip", "right_hip"),
        scale_sigma=size_sigma,
        neutral=gaussian.mean_rad,
        spread=gaussian.spread_rad,
        prior=prior.make(plan.prior_model, skeleton),
        length_sigma=worth.lengths,
        lean_sigma=worth.lean_rad,
        metric=worth.metric,
    )


def _at_a_distance(camera: Camera, rays: Array, in_world_m: Array | None) -> Array:
    """Places of detections at one distance from the camera for the whole clip, whose speed tells what rests.

    Args:
        camera: with a path.
        rays: (M, T, 2) undistorted detections x/z, y/z.
        in_world_m: (M', T, 3) of a 3D estimate in the world, whose median gives the distance; None: it is
            assumed.

    Returns:
        (M, T, 2) in the image of a camera that stands still, (M, T, 3) in the world of one that moves.
    """
    if cameras.is_still(camera):
        return rays * DISTANCE_M
    distance = DISTANCE_M
    if in_world_m is not None:
        distance = float(np.median(np.linalg.norm(in_world_m - cameras.centre_m(camera), axis=-1)))
    ahead = np.concatenate((rays, np.ones((*rays.shape[:2], 1))), axis=-1)  # (M, T, 3)
    ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
    return cameras.to_world(camera, distance * ahead)


def _resting(places: Array, known: Array, interval_s: float) -> Array:
    """How surely points (M, T, n), known by weights (M, T), all stand still, (T,): by their speed."""
    smooth = STILL_SMOOTH_S / interval_s
    if not known.any():
        return np.zeros(places.shape[1])
    weight = np.maximum(known, 1e-6)[..., None]
    total = gaussian_filter1d(weight, smooth, axis=1)
    smoothed = gaussian_filter1d(places * weight, smooth, axis=1) / total
    speed = np.linalg.norm(np.gradient(smoothed, interval_s, axis=1), axis=-1).max(axis=0)  # (T,)
    return np.asarray(np.exp(-((speed / STILL_MPS) ** 2)))
