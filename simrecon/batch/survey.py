"""What there is to do for a clip, and what it costs: read, hashed, and measured on a short piece."""

from __future__ import annotations

import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from simrecon import evidence, schedule
from simrecon import job as jobs
from simrecon import plan as plans
from simrecon.batch.clips import Clip
from simrecon.batch.failures import failure
from simrecon.drawing import overlay
from simrecon.errors import InputError
from simrecon.evidence import cut, cutting
from simrecon.evidence.video import frames, weights
from simrecon.io.messages import counted
from simrecon.io.provenance import code_digest, digest_of, file_digest
from simrecon.job import Job, Reading, inputs
from simrecon.results.folder import MOTION
from simrecon.running import run
from simrecon.sim.quiet import unwarned
from simrecon.types import Array, Evidence


def _times_s(job: Job) -> Array:
    """Times of an input's frames; landmarks of a video are not looked for."""
    video = inputs.background(job)
    if not inputs.is_video(job):
        seen = inputs.observe(job)
        if video is not None:
            overlay.check_video(video, seen, job.reading.rotate or 0)
        return evidence.resample(seen)[0].times_s
    info = frames.probe(Path(job.input))
    rate = job.reading.fps or info.rate_hz
    if info.count < cutting.LEAST_FRAMES or rate is None:
        found = f"{counted(info.count, 'frame')} at {rate or 0:g} Hz"
        raise InputError(f"{job.input}: found {found}, as it says; valid: a video that says both")
    times: Array = np.arange(info.count) / rate
    span = inputs.span(job.reading)
    return times if span.is_all else np.asarray(times[cutting.frames(times, span, job.input)])


def survey(clip: Clip) -> dict[str, Any]:
    """What there is to do for a clip.

    Returns:
        `name` and `key`, `plan_key`, `video_s`, `frames`, `windows`; or `name` and the failure's `kind`,
        `message` and `trace`.
    """
    try:
        with unwarned():
            job = clip.job(clip.name)
            times = _times_s(job)
            clock = schedule.clock(times, job.plan.simulation.timestep_max_s)
            return {
                "name": clip.name,
                "key": key(job),
                "plan_key": digest_of({"plan": plans.to_dict(job.plan), "code": code_digest()}),
                "video_s": float(times[-1] - times[0]),
                "frames": len(times),
                "windows": len(schedule.cut(clock, job.plan)),
            }
    except Exception as error:  # one clip that can't be read must not end a night of others
        return failure(clip.name, error)


def key(job: Job) -> str:
    """Hash of all that the result of a clip depends on: the job, what is drawn on, and the pose networks."""
    video = inputs.background(job)
    content = {
        "identity": jobs.identity(job),
        "video": None if video is None else file_digest(Path(video)),
        "networks": _networks(job),
    }
    return digest_of(content)


def _networks(job: Job) -> list[str]:
    """Hashes of the weights that look for landmarks, where there are any to be looked for.

    Raises:
        InputError: they are not there.
    """
    videos = [path for path in (job.input, job.reading.keypoints) if path is not None]
    if not any(Path(path).is_file() and evidence.is_video(path) for path in videos):
        return []
    return [weights.find(name)[1] for name in ("detector", job.reading.model or weights.best())]


def measure(clip: Clip, scratch: str) -> dict[str, float]:
    """What a short piece of a clip costs: two windows on one thread.

    Returns:
        `kinematics_s` (with the reading) per second of video, `first_s` and `window_s` of the first and a
        further window, `fixed_bytes`, and `bytes` per second of video.
    """
    job = clip.job(scratch)
    began = time.perf_counter()
    seen = inputs.observe(job)
    reading_s = (time.perf_counter() - began) / float(seen.times_s[-1] - seen.times_s[0])
    piece = shortened(seen, job.plan.window.length_s + job.plan.window.commit_s)
    video_s = float(piece.times_s[-1] - piece.times_s[0])
    with tempfile.TemporaryDirectory(prefix="simrecon-") as folder:
        file = Path(folder) / "piece.npz"
        evidence.write(file, piece)
        report = run(of_piece(job, file), threads=1, overwrite=True).report
    seconds = [window["seconds"] for window in report["windows"]] or [0.0]  # none where nothing is simulated
    size = {path.name: path.stat().st_size for path in Path(scratch).iterdir()}
    growing = sum(size.get(name, 0) for name in (MOTION, "overlay.mp4"))
    return {
        "kinematics_s": reading_s + report["totals"]["seconds"]["kinematics"] / video_s,
        "first_s": seconds[0],
        "window_s": seconds[-1],
        "bytes": growing / video_s,
        "fixed_bytes": float(sum(size.values()) - growing),
    }


def of_piece(job: Job, file: Path) -> Job:
    """The job of a piece of its evidence, read and turned already: not on a video that lies on its side."""
    ground = replace(job.scene.ground, calibrate=False)
    video = None if job.reading.rotate else job.video
    scene = replace(job.scene, ground=ground)
    return replace(job, input=str(file), reading=Reading(), scene=scene, video=video)


def shortened(evidence: Evidence, length_s: float) -> Evidence:
    """The first `length_s` of evidence, at least two frames."""
    count = max(
        2, int(np.searchsorted(evidence.times_s, evidence.times_s[0] + length_s + 1e-9, side="right"))
    )
    return cut(evidence, slice(count))
