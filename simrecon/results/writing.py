"""Writes a result folder: the whole of it appears at once, or nothing does."""

from __future__ import annotations

import shutil
import time
from dataclasses import replace
from pathlib import Path

from simrecon import job as jobs
from simrecon import scene as scenes
from simrecon.drawing import overlay
from simrecon.geometry import camera as cameras
from simrecon.io import atomic
from simrecon.job import Job
from simrecon.job.inputs import background
from simrecon.pipeline import Reconstruction
from simrecon.results import folder as folders
from simrecon.results import motion_file, report
from simrecon.softfloor import Calibration
from simrecon.types import Report


def write(job: Job, run: Reconstruction, calibration: Calibration | None = None) -> Report:
    """Write a result folder; an earlier result is replaced.

    Args:
        job: of the result; its folder is made.
        run: what was computed.
        calibration: of a soft floor, or None.

    Returns:
        What is in `report.json`.

    Raises:
        InputError: the folder can't be written (see `folder.check_writable`), or the video can't be used.
    """
    folders.check_writable(job.output)
    with folders.replacing(job.output) as partial:
        (partial / folders.MOTION).write_bytes(motion_file.dumps(run.motion))
        (partial / folders.MODEL).write_text(run.problem.mjcf, encoding="utf-8")
        (partial / folders.SCENE).write_text(scenes.dumps(run.fit.scene), encoding="utf-8")
        if job.start is not None:
            shutil.copyfile(job.start, partial / folders.START)
            job = replace(job, start=str(Path(job.output) / folders.START))
        (partial / folders.JOB).write_text(jobs.dumps(jobs.absolute(job)), encoding="utf-8")
        began = time.perf_counter()
        overlay.write(partial, clip(run), background(job))
        seconds = {**run.seconds, "overlay": time.perf_counter() - began}
        content = report.make(job, run, seconds, calibration)
        atomic.write_json(partial / folders.REPORT, content)
    return content


def clip(run: Reconstruction) -> overlay.Clip:
    """What is drawn of a run."""
    motion, evidence, camera = run.motion, run.evidence, run.fit.camera
    seen = bool(evidence.keypoint_names)
    return overlay.Clip(
        model=run.problem.model,
        times_s=motion.times_s,
        qpos=motion.qpos,
        camera=None if camera is None else cameras.resampled(camera, run.fit.times_s, motion.times_s),
        keypoints_px=evidence.keypoints_px if seen else None,
        scores=evidence.scores if seen else None,
        contact_point_m=motion.contact_point_m,
        contact_force_N=motion.contact_force_N,
        status=motion.status,
    )
