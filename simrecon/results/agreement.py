"""How near input, kinematic fit and simulation come to each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simrecon import kinematics, trust
from simrecon.body import names
from simrecon.geometry import camera as cameras
from simrecon.kinematics import bones
from simrecon.metrics import pose
from simrecon.pipeline import Reconstruction
from simrecon.results import ending
from simrecon.types import Array, Camera, IntArray

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Agreement:
    """Distances of a result from what it was made of; None where there is nothing to compare.

    Attributes:
        image_px: mean distance of the simulated body's points from the landmarks, each by its score.
        image_person_pct: the same, per cent of the person's height in the image.
        image_height_pct: the same, per cent of the image's height.
        person_px: the person's height in the image, standing, median over the frames.
        fit_mean_m: mean distance of the simulated body's points from the kinematic fit; fit_max_m: of the
            frame where it is largest; fit_max_s: its time.
        input_mean_m: mean distance of the kinematic fit from the joints of a metric source.
        bone: of the body that differs most from that of a metric source; bone_pct: how much longer it is, %.
        fell: whether the pelvis was far below the kinematic fit's for some time.
    """

    image_px: float | None
    image_person_pct: float | None
    image_height_pct: float | None
    person_px: float | None
    fit_mean_m: float
    fit_max_m: float
    fit_max_s: float
    input_mean_m: float | None
    bone: str | None
    bone_pct: float | None
    fell: bool


def make(run: Reconstruction) -> Agreement:
    """That of a run, over its frames of simulation or plan."""
    kept = run.motion.kept  # (T,)
    times = run.motion.times_s[kept]
    off = pose.distances(run.motion.joints_m[kept], _fitted(run)[kept]).mean(axis=1)  # (S,) m
    error, person, height = _in_image(run, kept)
    longer = bones.apart(run.evidence, run.fit.body.skeleton)
    bone = max(longer, key=lambda name: abs(longer[name]), default=None)
    return Agreement(
        image_px=error,
        image_person_pct=None if error is None or not person else 100 * error / person,
        image_height_pct=None if error is None or height is None else 100 * error / height,
        person_px=person,
        fit_mean_m=float(off.mean()),
        fit_max_m=float(off.max()),
        fit_max_s=float(times[off.argmax()]),
        input_mean_m=_from_input(run),
        bone=bone,
        bone_pct=None if bone is None else 100 * longer[bone],
        fell=ending.fell(run.motion),
    )


def frames_of(run: Reconstruction) -> IntArray:
    """Rows (T,) of the uniform clock that show the evidence's frames."""
    nearest = np.rint((run.motion.times_s - run.fit.times_s[0]) / run.problem.clock.frame_s)
    rows: IntArray = np.clip(nearest, 0, run.problem.clock.frames - 1).astype(np.int64)
    return rows


def _fitted(run: Reconstruction) -> Array:
    """Points (T, M, 3) of what the simulation follows, or of the fit that a plan is made of, by frame."""
    points_m = run.problem.points_m
    if run.motion.is_planned:
        points_m = kinematics.configurations(run.fit.body, run.fit.qpos)[1]
    return np.asarray(points_m[frames_of(run)])


@dataclass(frozen=True, eq=False)
class InImage:
    """Distances of the motion's points from the landmarks, in S frames.

    Attributes:
        off_px: (S, K); weights: (S, K), zero where not seen.
        person_px: the person's height in the image, or None; height_px: the image's.
    """

    off_px: Array
    weights: Array
    person_px: float | None
    height_px: int

    def by_frame(self) -> Array:
        """Mean of each frame, (S,) px; NaN where nothing is seen."""
        total = self.weights.sum(axis=1)
        summed = (self.weights * np.nan_to_num(self.off_px)).sum(axis=1)
        return np.where(total > 0, summed / np.maximum(total, 1e-12), np.nan)


def in_image(run: Reconstruction, kept: Mask) -> InImage | None:
    """Distances from the landmarks in some frames (T,); None without landmarks or camera."""
    evidence, fit = run.evidence, run.fit
    if fit.camera is None or not evidence.keypoint_names:
        return None
    points = names.resolve(evidence.keypoint_names)
    known = points != names.IGNORED
    camera = cameras.resampled(fit.camera, fit.times_s, run.motion.times_s[kept])
    shown = cameras.project(camera, run.motion.joints_m[kept][:, points[known]])
    seen, height = evidence.keypoints_px[kept][:, known], camera.lens.image_size_px[1]
    off = np.where(np.isfinite(shown).all(axis=-1), pose.distances(shown, seen), height)  # (S, K) px
    weights = np.where(np.isfinite(seen).all(axis=-1), np.nan_to_num(evidence.scores[kept][:, known]), 0.0)
    return InImage(off, weights, _person_px(run, camera, kept), height)


def _in_image(run: Reconstruction, kept: Mask) -> tuple[float | None, float | None, int | None]:
    """Mean distance from the landmarks, the person's height, and the image's, px."""
    found = in_image(run, kept)
    if found is None:
        return None, None, None
    total = float(found.weights.sum())
    error = float((found.weights * np.nan_to_num(found.off_px)).sum()) / total if total > 0 else None
    return error, found.person_px, found.height_px


def _person_px(run: Reconstruction, camera: Camera, kept: Mask) -> float | None:
    """Height of the person as they would stand, where they are: focal length · stature / depth."""
    depth = cameras.to_camera(camera, run.motion.com_m[kept][:, None])[:, 0, 2]  # (S,)
    ahead = depth[depth > 0]
    if not ahead.size:
        return None
    return float(cameras.focal_px(camera.lens) * run.fit.body.height_m / np.median(ahead))


def _from_input(run: Reconstruction) -> float | None:
    """How far the fit is from joints that are metres in the scene's own world."""
    evidence = run.evidence
    if not (evidence.joint_names and evidence.joints_frame == "world" and trust.of(evidence).metric):
        return None
    points = names.resolve(evidence.joint_names)
    known = points != names.IGNORED
    off = pose.distances(_fitted(run)[:, points[known]], evidence.joints_m[:, known])
    mean = float(pose.mean_known(off, (0, 1)))
    return mean if np.isfinite(mean) else None
