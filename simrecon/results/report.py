"""What `report.json` says of a run; plain dictionaries of numbers, text, lists and None."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from simrecon import body as bodies
from simrecon import plan as plans
from simrecon import scene as scenes
from simrecon import trust
from simrecon.body import names
from simrecon.body.primitives import FEET
from simrecon.evidence import cutting, sides
from simrecon.geometry import camera as cameras
from simrecon.io import provenance, tables
from simrecon.job import Job
from simrecon.metrics import feet, pose
from simrecon.metrics.clearance import box_clearance
from simrecon.metrics.rates import H36M_HZ, resampled
from simrecon.metrics.statistics import of_frames
from simrecon.pipeline import Reconstruction
from simrecon.replay import FALLBACK, PLANNED, SIMULATED
from simrecon.results import agreement, assumed, by_second, contacts, ending, planned, seen_by, verdict
from simrecon.results.folder import MOTION, SCHEMA
from simrecon.results.plain import plain
from simrecon.sim.address import locate
from simrecon.sim.poses import posed
from simrecon.softfloor import Calibration
from simrecon.types import Array, Evidence, KinematicFit, Report, WindowResult

_FOOT_JOINTS = ("left_ankle", "right_ankle")


def make(
    job: Job, run: Reconstruction, seconds: dict[str, float], calibration: Calibration | None = None
) -> Report:
    """Everything about a run that is not in its arrays.

    Args:
        job: of the result.
        run: what was computed.
        seconds: wall time by stage.
        calibration: of a soft floor, or None.

    Returns: by section; what can't be said of this run is None.
    """
    step_s = run.problem.clock.step_s
    sections = {
        "schema": SCHEMA,
        "versions": provenance.versions(),
        "input": _input(run, job),
        "plan_name": job.plan.name,
        "plan": plans.to_dict(run.problem.plan),
        "planner": job.planned_by,
        "engine": job.engine,
        "seed": job.seed,
        "threads": job.threads,
        "windows": [_window(result, step_s) for result in run.windows],
        "totals": totals(run, seconds),
        "person": _person(run.fit),
        "kinematics": {
            "iterations": run.fit.iterations,
            "loss_terms": run.fit.loss,
            "reprojection_median_px": _median(run.fit.reprojection_px),
        },
        "contacts": contacts.make(run),
        "frames": _frames(run),
        "metrics": plausibility(run),
        "audit": dataclasses.asdict(run.audit),
        "assumed": assumed.make(job, run),
        "camera": seen_by.make(run),
        "agreement": dataclasses.asdict(agreement.make(run)),
        "planned": planned.make(run),
        "planner_notes": list(run.reference.notes),
        "gaps": ending.make(run),
        "by_second": by_second.make(run),
    }
    if calibration is not None:
        sections["soft_floor"] = _soft_floor(calibration)
    content = {key: plain(value) for key, value in sections.items()}
    return {**content, "verdict": verdict.judge(content)}


def source_of(job: Job) -> str:
    """The file that a job's evidence is read from."""
    return str(Path(job.input) / MOTION) if job.retarget else job.detected or job.input


def _input(run: Reconstruction, job: Job) -> dict[str, Any]:
    """The file, how it was read, and the frames by limbs in which it had left and right mixed up."""
    evidence, worth = run.evidence, trust.of(run.evidence)
    return {
        "name": source_of(job),
        "sha256": evidence.sha256,
        "reading": evidence.reading or None,
        "part": cutting.as_dict(evidence),
        "trust": tables.to_table(worth) | {"source": worth.source},
        "exchanged": sides.find(evidence).as_dict(),
    }


def _soft_floor(calibration: Calibration) -> dict[str, Any]:
    """What was found of a compliant floor, and the loss of everything that was tried."""
    return {
        "stiffness_Npm": calibration.ground.stiffness_Npm,
        "damping_Nspm": calibration.ground.damping_Nspm,
        "at_bound": calibration.at_bound,
        "trials": [dataclasses.asdict(trial) for trial in calibration.trials],
    }


def plausibility(run: Reconstruction) -> dict[str, float | None]:
    """Scores of the frames of simulation or plan that need no reference; docs/metrics.md defines them.

    Returns:
        By name with unit. Footskate and float are `footskate_gartner_pct` and `float_gartner_pct`;
        `mean_grf_pct_bw` is the mean vertical contact force over body weight; None of a plan without forces.
    """
    motion, model = run.motion, run.problem.model
    kept = motion.kept  # (T,)
    columns = [motion.joint_names.index(name) for name in _FOOT_JOINTS]
    ankles, clearance = motion.joints_m[kept][:, columns], _foot_clearance(run)  # (S, 2, 3), (S, 2)
    weight_N = locate(model).mass_kg(model) * float(np.linalg.norm(model.opt.gravity))
    if kept.sum() > 1:
        ankles, clearance = (resampled(motion.times_s[kept], x, H36M_HZ) for x in (ankles, clearance))
    return {
        "footskate_pct": 100.0 * of_frames(feet.footskate_steps(ankles, clearance)).value,
        "float_pct": 100.0 * of_frames(feet.float_frames(clearance)).value,
        "penetration_mean_mm": run.audit.floor_penetration_mean_mm,
        "penetration_max_mm": run.audit.floor_penetration_max_mm,
        "mean_grf_pct_bw": 100 * of_frames(motion.grf_N[kept, 2]).value / weight_N
        if motion.knows_forces
        else None,
        "mpjpe_2d_px": _mpjpe_2d(run),
    }


def _foot_clearance(run: Reconstruction) -> Array:
    """Height of each foot's lowest corner over what is under its centre, (S, 2); none of the fallback."""
    model, qpos = run.problem.model, run.motion.qpos[run.motion.kept]
    boxes = locate(model).geoms(model, FEET)
    centres, axes = np.empty((len(qpos), 2, 3)), np.empty((len(qpos), 2, 3, 3))
    for frame, data in enumerate(posed(model, qpos)):
        centres[frame], axes[frame] = data.geom_xpos[boxes], data.geom_xmat[boxes].reshape(-1, 3, 3)
    support = scenes.support_height(run.fit.scene, centres[..., :2])  # (S, 2)
    return box_clearance(centres, axes, model.geom_size[boxes], support)


def _mpjpe_2d(run: Reconstruction) -> float | None:
    """Mean reprojection error of the motion's points, px; None without 2D landmarks or a camera."""
    evidence, kept = run.evidence, run.motion.kept
    if run.fit.camera is None or not evidence.keypoint_names:
        return None
    points = names.resolve(evidence.keypoint_names)
    known = points != names.IGNORED
    camera = cameras.resampled(run.fit.camera, run.fit.times_s, run.motion.times_s[kept])
    shown = cameras.project(camera, run.motion.joints_m[kept][:, points[known]])
    errors = pose.distances(shown, evidence.keypoints_px[kept][:, known])  # (S, K) px
    return float(pose.mean_known(errors, (0, 1)))


def _window(result: WindowResult, step_s: float) -> dict[str, Any]:
    window = result.window
    return {
        "start_s": window.start_step * step_s,
        "commit_s": window.commit_step * step_s,
        "end_s": window.end_step * step_s,
        "status": result.status.value,
        "retry": result.effort.retry,
        "again": result.effort.again,
        "loss": result.loss,
        "loss_terms": result.loss_terms,
        "descent_steps": result.descent_steps,
        "generations": len(result.trace) - 1 - result.descent_steps,
        "evaluations": result.evaluations,
        "seconds": result.seconds,
        "stepping_s": result.stepping_s,
    }


def totals(run: Reconstruction, seconds: dict[str, float]) -> dict[str, Any]:
    """Sums over windows and stages; a rollout of N steps takes one step more for its last derived fields."""
    wall_s, video_s = sum(seconds.values()), float(run.evidence.times_s[-1] - run.evidence.times_s[0])
    stepping_s = sum(result.stepping_s for result in run.windows)
    simulation_s = sum(result.seconds for result in run.windows)
    lengths = [result.window.end_step - result.window.start_step + 1 for result in run.windows]
    return {
        "seconds": seconds,
        "wall_s": wall_s,
        "cpu_s": run.cpu_s,
        "video_s": video_s,
        "seconds_per_second": wall_s / video_s,
        "stepping_share": stepping_s / simulation_s if simulation_s > 0 else None,
        "windows": len(run.windows),
        "rollouts": sum(result.evaluations for result in run.windows),
        "steps": sum(n * result.evaluations for n, result in zip(lengths, run.windows, strict=True)),
    }


def _person(fit: KinematicFit) -> dict[str, Any]:
    return {
        "height_m": fit.body.height_m,
        "mass_kg": fit.body.mass_kg,
        "betas": fit.body.betas,
        "shape_space": fit.body.shape_space,
        "lengths_m": bodies.measure_template(fit.body.skeleton),
    }


def _frames(run: Reconstruction) -> dict[str, Any]:
    """Counts, and indices of the frames that are not simulated, or in which the person was out of view."""
    times = run.motion.times_s
    interpolated = np.flatnonzero(run.fit.interpolated[agreement.frames_of(run)])
    fallback = np.flatnonzero(run.motion.status == FALLBACK)
    return {
        "count": len(times),
        "simulated": int(np.count_nonzero(run.motion.status == SIMULATED)),
        "planned": int(np.count_nonzero(run.motion.status == PLANNED)),
        "fallback": len(fallback),
        "interpolated": len(interpolated),
        "fallback_frames": fallback,
        "interpolated_frames": interpolated,
        "points_seen": _points_seen(run.evidence),
    }


def _points_seen(evidence: Evidence) -> float | None:
    """Landmarks and joints that are seen in a frame, the median; None where the evidence has neither."""
    if not evidence.keypoint_names and not evidence.joint_names:
        return None
    flat = (np.isfinite(evidence.keypoints_px).all(axis=-1) & (evidence.scores > 0)).sum(axis=-1)
    solid = np.isfinite(evidence.joints_m).all(axis=-1).sum(axis=-1)
    return float(np.median(np.maximum(flat, solid)))


def _median(values: Array) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else None
