"""Writes a result folder: it appears whole or not at all, and nothing better is replaced."""

from __future__ import annotations

import contextlib
import shutil
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from simrecon import job as jobs
from simrecon import scene as scenes
from simrecon.body import clothed
from simrecon.contact import wishes
from simrecon.drawing import overlay
from simrecon.errors import InputError
from simrecon.geometry import camera as cameras
from simrecon.io import atomic
from simrecon.job import Job, request
from simrecon.job.inputs import background
from simrecon.pipeline import Reconstruction
from simrecon.results import beside, motion_file, placing, ranking, report, report_file
from simrecon.results import folder as folders
from simrecon.results.view import Result, open_result
from simrecon.softfloor import Calibration
from simrecon.types import Report

NOT_DRAWN = "the run ended while it was drawn"


def write(
    job: Job,
    run: Reconstruction,
    calibration: Calibration | None = None,
    *,
    landmarks: Path | None = None,
    overwrite: bool = False,
    keep: bool = True,
) -> Result:
    """Write a result folder: the motion with all that belongs to it first, then a picture of it.

    A picture that can't be drawn, or landmarks that can't be kept, cost a line in the report, not the motion;
    a picture does so even if the process is killed while it is drawn.

    Args:
        job: of the result; its folder is made.
        run: what was computed.
        calibration: of a soft floor, or None.
        landmarks: evidence file of a video, which is kept beside the result; None: there is none.
        overwrite: also replace an earlier result that is better; else this one is put beside it, into the
            first of `OUT-2`, `OUT-3`, … that is free.
        keep: see `placing.replacing`.

    Returns:
        The result that was written, in its folder.

    Raises:
        InputError: the folder can't be written (see `folder.check_writable`).
    """
    folders.check_writable(job.output)
    with placing.replacing(job.output, keep=keep) as place:
        partial = place.partial
        (partial / folders.MOTION).write_bytes(motion_file.dumps(run.motion))
        (partial / folders.MODEL).write_text(run.problem.mjcf, encoding="utf-8")
        atomic.write_text(partial / folders.SCENE, scenes.dumps(run.fit.scene))
        if job.contacts:
            (partial / folders.CONTACTS).write_text(wishes.dumps(job.contacts), encoding="utf-8")
        content = report.make(job, run, run.seconds, calibration)
        if not overwrite and _is_worse(content, place.target):
            content["better"] = str(place.target)
            place.target = placing.free(place.target)
        job = _settled(job, place, landmarks, overwrite=overwrite)
        content["input"]["name"], content["overlay"] = report.source_of(job), NOT_DRAWN
        content["landmarks"] = content["page"] = None
        _describe(partial, job, content)
        if landmarks is not None and (lost := _keep(landmarks, job)):
            job = replace(request.taken_anew(job, ("detected",)), detected=None)
            content["landmarks"], content["input"]["name"] = lost, report.source_of(job)
            _describe(partial, job, content)
    if place.kept is not None:
        content["earlier"] = str(place.kept)
    _add_overlay(place.target, job, run, content)
    return open_result(Path(job.output) if place.target == Path(job.output).resolve() else place.target)


def note(folder: Path, **sections: Any) -> None:
    """Write further sections into the report of a finished result.

    Raises:
        InputError: it can't be read. OSError: it can't be written.
    """
    content = report_file.read(folder) | sections
    atomic.write_json(folder / folders.REPORT, content, durable=True)


def _describe(partial: Path, job: Job, content: Report) -> None:
    """Write the job and the report."""
    text = jobs.dumps(jobs.absolute(job))
    (partial / folders.JOB).write_bytes(text.encode("utf-8", "surrogateescape"))  # paths may be any bytes
    atomic.write_json(partial / folders.REPORT, content)


def _keep(landmarks: Path, job: Job) -> str | None:
    """Put the landmarks of a video beside the result; what kept them from being written, or None."""
    if job.detected is None:
        return None
    try:
        atomic.write_bytes(job.detected, landmarks.read_bytes())
    except OSError as error:
        return f"{job.detected}: {error.strerror or error}"
    return None


def _add_overlay(folder: Path, job: Job, run: Reconstruction, content: Report) -> None:
    """Draw into a finished result, and say so in its report, or what kept it from being drawn."""
    began = time.perf_counter()
    try:
        missing = _draw(folder, job, run)
    except KeyboardInterrupt as error:
        raise KeyboardInterrupt(f"{job.output} is whole but for its picture") from error
    content["overlay"] = missing
    content["totals"] = report.totals(run, {**run.seconds, "overlay": time.perf_counter() - began})
    atomic.write_json(folder / folders.REPORT, content, durable=True)


def _draw(folder: Path, job: Job, run: Reconstruction) -> str | None:
    """Draw the overlay; what kept it from being drawn, or None."""
    try:
        overlay.write(folder, animation(run, job.style), background(job), job.reading.rotate or 0)
    except BaseException as error:
        for name in folders.OVERLAYS:
            with contextlib.suppress(OSError):
                (folder / name).unlink()
        if not isinstance(error, Exception):
            raise
        return " ".join(f"{error}".split()) or type(error).__name__
    return None


def _is_worse(content: Report, target: Path) -> bool:
    """Whether there is an earlier result that this one is worse than; one that can't be read is not."""
    if not (target / folders.REPORT).is_file():
        return False
    try:
        return ranking.is_worse(content, report_file.read(target))
    except (InputError, LookupError, TypeError, ValueError, ZeroDivisionError):
        return False


def _settled(job: Job, place: placing.Place, landmarks: Path | None, *, overwrite: bool) -> Job:
    """The job with the files that are kept for it, in the result and beside it."""
    if job.start is not None:
        shutil.copyfile(job.start, place.partial / folders.START)
        job = request.moved(job, "start", str(place.target / folders.START))
    if landmarks is not None:
        kept = beside.place(landmarks, place.target, overwrite=overwrite)
        job = request.moved(job, "detected", str(kept))
    return job if place.target == Path(job.output).resolve() else replace(job, output=str(place.target))


def animation(run: Reconstruction, style: str = "skin") -> overlay.Animation:
    """What is drawn of a run, in a style of `clothed.STYLES`."""
    motion, evidence = run.motion, run.evidence
    camera = run.fit.camera if overlay.is_placed(evidence) else None
    seen = bool(evidence.keypoint_names)
    return overlay.Animation.of(
        run.problem.model,
        motion,
        camera=None if camera is None else cameras.resampled(camera, run.fit.times_s, motion.times_s),
        keypoints_px=evidence.keypoints_px if seen else None,
        scores=evidence.scores if seen else None,
        part=evidence.part,
        skin=clothed.skin(run.fit.body) if style == "skin" else None,
    )
