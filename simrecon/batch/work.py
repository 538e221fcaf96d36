"""What a worker process does for one clip; it knows neither the scheduler nor the other clips.

All is written to disk; what is returned is small: figures, paths and messages.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import re
import shutil
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from simrecon import checkpoint, evidence, reconstruct, results, schedule, softfloor
from simrecon import plan as plans
from simrecon import scene as scenes
from simrecon.batch import journal
from simrecon.batch.clips import Clip
from simrecon.batch.journal import Places
from simrecon.bench.task import code_digest
from simrecon.body import names
from simrecon.errors import InputError, SimreconError
from simrecon.evidence import lens
from simrecon.plan import Plan
from simrecon.results import folder, overlay, report, video
from simrecon.types import Evidence, Motion, Scene, Window, WindowResult

FREE_MIN_BYTES = 1 << 20
"""With less left on the disk after a result was written it may not be whole: video encoders do not say."""
FALL_M, FALL_S = 0.3, 0.2
"""A person fell whose pelvis is so far below the kinematic fit's for so long."""
THUMBNAILS, THUMBNAIL_PX = 5, 80
_LOCK_INTERVAL_S = 0.5

Tell = Callable[[dict[str, Any]], None]


class StoppedError(SimreconError):
    """The batch was told to end, or another one took the folder over: what is solved is kept."""


@dataclass(frozen=True)
class Job:
    """A clip, the batch's folder and id, the key that its result will have, and the code that makes it."""

    clip: Clip
    root: str
    run: str
    key: str
    code: str


@dataclass(frozen=True, eq=False)
class Inputs:
    """All that a clip is made from, read."""

    evidence: Evidence
    scene: Scene
    plan: Plan


def read(clip: Clip) -> Inputs:
    """Read and check evidence, plan, scene and video.

    Raises:
        InputError: one of them can't be used.
    """
    given = Path(clip.input)
    rate, size = lens.probe(clip.video) if clip.video is not None else (None, None)
    if clip.width_px is not None and clip.height_px is not None:
        size = (clip.width_px, clip.height_px)
    asked = evidence.Options(
        format=clip.format,
        up=clip.up,
        unit=clip.unit,
        frame=clip.frame,
        person=clip.person,
        fps=clip.fps,
        video_fps=rate,
        camera=lens.from_fov(clip.fov_deg, size),
    )
    seen = evidence.read(given, asked, keypoints=clip.keypoints, keypoints_person=clip.keypoints_person)
    evidence.check_names(seen, names.valid_names(), given)
    seen = replace(seen, height_m=clip.height_m or seen.height_m, mass_kg=clip.mass_kg or seen.mass_kg)
    if clip.video is not None:
        overlay.check_video(clip.video, seen.times_s, seen.camera)
    scene = scenes.read(clip.scene) if clip.scene is not None else Scene()
    return Inputs(seen, scene, plans.read(clip.plan))


def survey(clip: Clip) -> dict[str, Any]:
    """What there is to do for a clip.

    Returns:
        `name` and `key`, `plan_key`, `video_s`, `frames`, `windows`; or `name` and the failure's `kind`,
        `message` and `trace`.
    """
    try:
        with _quiet():
            inputs = read(clip)
            uniform, _ = evidence.resample(inputs.evidence)
            clock = schedule.clock(uniform.times_s, inputs.plan.simulation.timestep_max_s)
            times = inputs.evidence.times_s
            return {
                "name": clip.name,
                "key": key(clip, inputs),
                "plan_key": digest({"plan": plans.to_dict(inputs.plan), "code": code_digest()}),
                "video_s": float(times[-1] - times[0]),
                "frames": len(times),
                "windows": len(schedule.cut(clock, inputs.plan)),
            }
    except Exception as error:  # one clip that can't be read must not end a night of others
        return failure(clip.name, error)


def key(clip: Clip, inputs: Inputs) -> str:
    """Hash of all that a clip's result depends on: files, plan, scene, options, versions and the code."""
    files = {name: getattr(clip, name) for name in ("input", "keypoints", "video")}
    meshes = [value for item in inputs.scene.items for value in item.parameters.values()]
    paths = [Path(inputs.scene.folder) / value for value in meshes if isinstance(value, str)]
    options = {name: value for name, value in asdict(clip).items() if name not in (*files, "name", "scene")}
    del options["plan"]
    content = {
        "files": {name: _hash(Path(path)) for name, path in files.items() if path is not None},
        "meshes": [_hash(path) for path in paths if path.is_file()],
        "scene": scenes.dumps(inputs.scene),
        "plan": plans.to_dict(inputs.plan),
        "options": options,
        "versions": report.versions(),
        "code": code_digest(),
    }
    return digest(content)


def digest(content: Any) -> str:
    """Hash of plain data."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _hash(path: Path) -> str:
    """Of a file's bytes, or of all files in a folder with their names."""
    if path.is_file():
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    inside = sorted(item for item in path.rglob("*") if item.is_file())
    return digest([(item.relative_to(path).as_posix(), _hash(item)) for item in inside])


def failure(name: str, error: BaseException) -> dict[str, Any]:
    """How a clip failed: `kind` is `disk`, `stopped`, `input` (the same would come again) or `error`."""
    causes, cause = [], error
    while cause is not None and cause not in causes:
        causes.append(cause)
        cause = cause.__cause__ or cause.__context__  # type: ignore[assignment]
    full = any(isinstance(item, OSError) and journal.is_full(item) for item in causes)
    kind = "input" if isinstance(error, InputError) else "error"
    if full or isinstance(error, journal.DiskFullError):
        kind = "disk"
    elif isinstance(error, StoppedError):
        kind = "stopped"
    ours = isinstance(error, SimreconError)
    message = str(error) if ours else f"{type(error).__name__}: {error}"
    trace = "" if ours else "".join(traceback.format_exception(error))
    return {"name": name, "kind": kind, "message": " ".join(message.split()), "trace": trace}


def solve(
    job: Job,
    *,
    threads: Callable[[], int] | int = 0,
    tell: Tell = lambda _: None,
    stop: Callable[[], bool] = lambda: False,
) -> dict[str, Any]:
    """Reconstruct a clip from its last checkpoint on and put its result in place.

    Args:
        job: what to do.
        threads: of the simulator, asked before every rollout if it is a function.
        tell: told of the beginning and of every window.
        stop: whether to end after the next window.

    Returns:
        `name` and `figures`, or what `failure` says.
    """
    places, name = Places(Path(job.root)), job.clip.name
    try:
        with _quiet(), _alone(places, job):
            return {"name": name, "figures": _solve(job, places, threads, tell, stop)}
    except Exception as error:
        found = failure(name, error)
        with contextlib.suppress(OSError):
            note(places, name, f"{found['kind']}: {found['message']}\n{found['trace']}".rstrip())
        return found


def _solve(
    job: Job, places: Places, threads: Callable[[], int] | int, tell: Tell, stop: Callable[[], bool]
) -> dict[str, Any]:
    clip, target = job.clip, places.result(job.clip.name)
    if job.code != code_digest():
        raise SimreconError("the worker has another version of simrecon than the batch; install the same")
    _tidy(places, job)
    results.check_writable(target)
    inputs = read(clip)
    store = _Watched(places, job, tell, stop)
    how: dict[str, Any] = {"seed": clip.seed, "threads": threads, "checkpoint": store}
    given, scene, found = inputs.evidence, inputs.scene, None
    start: Motion | None = None
    began = time.perf_counter()
    if scene.ground.stiffness_Npm == scenes.FIT:
        found = softfloor.calibrate(given, scene, inputs.plan, **how)
        scene, start = replace(scene, ground=found.ground), found.motion
    made = reconstruct.reconstruct(given, scene, inputs.plan, start=start, **how)
    said = results.write(
        target,
        made,
        plan_name=clip.plan,
        seed=clip.seed,
        input_name=clip.input,
        video=clip.video,
        calibration=found,
    )
    places.thumbnail(clip.name).parent.mkdir(parents=True, exist_ok=True)
    shown = replace(folder.clip(made), keypoints_px=None, scores=None)
    strip = overlay.sheet(shown, THUMBNAILS, THUMBNAIL_PX, columns=THUMBNAILS)
    video.write_image(places.thumbnail(clip.name), strip)
    if shutil.disk_usage(target).free < FREE_MIN_BYTES:
        shutil.rmtree(target)
        raise journal.DiskFullError(f"{target}: the disk is full, so the result may not be whole")
    figures = _figures(said, made.motion, time.perf_counter() - began)
    journal.write_json(places.record(clip.name), {"key": job.key, "figures": figures})
    shutil.rmtree(places.checkpoints(clip.name), ignore_errors=True)
    note(places, clip.name, f"done: {figures['verdict']}, {figures['wall_s']:.1f} s")
    return figures


def _figures(said: dict[str, Any], motion: Motion, here_s: float) -> dict[str, Any]:
    """What the batch's report shows of a result; `here_s`: wall time since the last start."""
    frames, windows, totals = said["frames"], said["windows"], said["totals"]
    drop = fell(motion)
    verdict = "fell" if drop else "all simulated"
    if frames["fallback"]:
        verdict = f"{frames['fallback']} fallback frames"
    return {
        "verdict": verdict,
        "fell": drop,
        "frames": frames["count"],
        "fallback": frames["fallback"],
        "video_s": totals["video_s"],
        "wall_s": totals["wall_s"],
        "here_s": here_s,
        "windows": len(windows),
        "loss": sum(window["loss"] for window in windows) / len(windows) if windows else None,
        "metrics": said["metrics"],
        "replay_exact": said["audit"]["replay_exact"],
    }


def fell(motion: Motion) -> bool:
    """Whether the pelvis was `FALL_M` or more below that of the kinematic fit for `FALL_S` on end."""
    if motion.kinematic_qpos is None:
        return False
    low = motion.kinematic_qpos[:, 2] - motion.qpos[:, 2] >= FALL_M  # (T,)
    since = None
    for time_s, under in zip(motion.times_s, low, strict=True):
        since = (time_s if since is None else since) if under else None
        if since is not None and time_s - since >= FALL_S:
            return True
    return False


def measure(clip: Clip, scratch: str) -> dict[str, float]:
    """What a short piece of a clip costs: two windows on one thread.

    Returns:
        `kinematics_s` per second of video, `first_s` and `window_s` of the first and a further window,
        `fixed_bytes`, and `bytes` per second of video.
    """
    inputs = read(clip)
    length_s = inputs.plan.window.length_s + inputs.plan.window.commit_s
    piece = shortened(inputs.evidence, length_s)
    scene = inputs.scene
    if scene.ground.stiffness_Npm == scenes.FIT:
        scene = replace(scene, ground=replace(scene.ground, stiffness_Npm=None, damping_Nspm=None))
    with _quiet():
        made = reconstruct.reconstruct(piece, scene, inputs.plan, seed=clip.seed, threads=1)
        results.write(scratch, made, plan_name=clip.plan, seed=clip.seed, video=clip.video)
    seconds = [window.seconds for window in made.windows]
    video_s = float(piece.times_s[-1] - piece.times_s[0])
    size = {path.name: path.stat().st_size for path in Path(scratch).iterdir()}
    growing = sum(size.get(name, 0) for name in (folder.MOTION, "overlay.mp4"))
    return {
        "kinematics_s": made.seconds["kinematics"] / video_s,
        "first_s": seconds[0],
        "window_s": seconds[-1],
        "bytes": growing / video_s,
        "fixed_bytes": float(sum(size.values()) - growing),
    }


def shortened(given: Evidence, length_s: float) -> Evidence:
    """The first `length_s` of evidence, at least two frames."""
    count = max(2, int(np.searchsorted(given.times_s, given.times_s[0] + length_s + 1e-9, side="right")))
    camera = given.camera
    if camera is not None and camera.world_to_camera is not None and camera.world_to_camera.ndim == 3:
        camera = replace(camera, world_to_camera=camera.world_to_camera[:count])
    return replace(
        given,
        times_s=given.times_s[:count],
        keypoints_px=given.keypoints_px[:count],
        scores=given.scores[:count],
        joints_m=given.joints_m[:count],
        rotations=None if given.rotations is None else given.rotations[:count],
        camera=camera,
    )


def note(places: Places, name: str, text: str) -> None:
    """Add to a clip's log."""
    path = places.log(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as stream:
        stream.write(f"{time.strftime('%Y-%m-%d %H:%M:%S')}  {text}\n")


class _Watched(checkpoint.Folder):
    """Checkpoints of a job that tell the batch, and end the work when it is to end."""

    def __init__(self, places: Places, job: Job, tell: Tell, stop: Callable[[], bool]) -> None:
        super().__init__(places.checkpoints(job.clip.name) / job.key[:16])
        self._places, self._job, self._tell, self._stop = places, job, tell, stop

    def restore(self, digest: str, windows: Sequence[Window], rng: np.random.Generator) -> list[WindowResult]:
        """Say where the work goes on."""
        found = super().restore(digest, windows, rng)
        name = self._job.clip.name
        if found:
            note(self._places, name, f"goes on after window {len(found)} of {len(windows)}")
        self._tell({"event": "started", "clip": name, "window": len(found), "windows": len(windows)})
        return found

    def save(self, result: WindowResult, rng: np.random.Generator) -> None:
        """Keep it, tell, and end if that was asked for."""
        super().save(result, rng)
        done, name = result.window.index + 1, self._job.clip.name
        count = len(self.windows)
        line = f"window {done} of {count}: loss {result.loss:.2f}, {result.seconds:.1f} s"
        note(self._places, name, line)
        content = {"window": done, "windows": count, "loss": round(result.loss, 4)}
        self._tell({"event": "window", "clip": name, **content})
        if done < count and (self._stop() or not journal.check_alive(self._places, self._job.run)):
            raise StoppedError(f"{name}: stopped after window {done} of {count}, which is kept")


@contextlib.contextmanager
def _alone(places: Places, job: Job) -> Iterator[None]:
    """Hold the clip: a worker that a lost batch left behind may still be at its last window."""
    path = places.clip_lock(job.clip.name)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a") as stream:
        while True:
            try:
                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                if not journal.check_alive(places, job.run):
                    raise StoppedError(f"{job.clip.name}: the batch is gone") from None
                time.sleep(_LOCK_INTERVAL_S)
        yield


def _tidy(places: Places, job: Job) -> None:
    """Remove what a killed worker left half done, and checkpoints for another key."""
    name = job.clip.name
    debris = re.compile(rf"\.{re.escape(name)}\.(\d+\.(partial|earlier)|\w{{8}})")
    for path in places.root.iterdir():
        if debris.fullmatch(path.name) and path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
    kept = places.checkpoints(name)
    for path in kept.iterdir() if kept.is_dir() else ():
        if path.name != job.key[:16]:
            shutil.rmtree(path, ignore_errors=True)


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Rollouts that diverge are expected, and counted; MuJoCo would print each, and log it in a file here."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)
