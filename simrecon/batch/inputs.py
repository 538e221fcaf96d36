"""What a clip is made from: read, hashed, and measured on a short piece."""

from __future__ import annotations

import contextlib
import hashlib
import json
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import mujoco
import numpy as np

from simrecon import evidence, pipeline, results, schedule
from simrecon import plan as plans
from simrecon import scene as scenes
from simrecon.batch.clips import Clip
from simrecon.batch.failures import failure
from simrecon.body import names
from simrecon.drawing import overlay
from simrecon.errors import InputError
from simrecon.evidence import fov, lens
from simrecon.evidence.options import place
from simrecon.evidence.video import weights
from simrecon.geometry import camera as cameras
from simrecon.io import provenance
from simrecon.io.provenance import code_digest
from simrecon.plan import Plan
from simrecon.results import folder
from simrecon.types import Array, Evidence, Scene

Progress = Callable[[float, float], None]


@dataclass(frozen=True, eq=False)
class Inputs:
    """All that a clip is made from, read."""

    evidence: Evidence
    scene: Scene
    plan: Plan


def read(clip: Clip, progress: Progress | None = None) -> Inputs:
    """Read and check evidence, plan, scene and video.

    Args:
        clip: what to read.
        progress: told how many frames of a video are done, and how many there are.

    Raises:
        InputError: one of them can't be used.
    """
    given = Path(clip.input)
    video = shown(clip)
    rate, size = fov.probe(video) if video is not None else (None, None)
    if clip.width_px is not None and clip.height_px is not None:
        size = (clip.width_px, clip.height_px)
    camera, said = fov.from_fov(clip.fov_deg, size), f"--fov {clip.fov_deg:g}" if clip.fov_deg else ""
    if clip.camera is not None:
        hint = video or clip.input
        camera, said = lens.read(clip.camera, name=clip.camera_name, size_px=size, up=clip.up, hint=hint)
    asked = evidence.Options(
        format=clip.format,
        up=clip.up,
        unit=clip.unit,
        frame=clip.frame,
        person=clip.person,
        person_at=None if clip.person_at is None else place(clip.person_at),
        model=clip.model,
        fps=clip.fps,
        video_fps=rate,
        camera=camera,
        lens=said,
        progress=progress,
    )
    seen = evidence.read(given, asked, keypoints=clip.keypoints, keypoints_person=clip.keypoints_person)
    evidence.check_names(seen, names.valid_names(), given)
    seen = replace(seen, height_m=clip.height_m or seen.height_m, mass_kg=clip.mass_kg or seen.mass_kg)
    if video is not None and (seen.camera is not None or clip.video is not None):
        overlay.check_video(video, seen.times_s, seen.camera)
    return Inputs(seen, *_settings(clip))


def _settings(clip: Clip) -> tuple[Scene, Plan]:
    return scenes.read(clip.scene) if clip.scene is not None else Scene(), plans.read(clip.plan)


def shown(clip: Clip) -> str | None:
    """The video that the overlay is drawn on: an input that is one, if no other is given."""
    is_video = Path(clip.input).is_file() and evidence.is_video(clip.input)
    return clip.input if clip.video is None and is_video else clip.video


def _times_s(clip: Clip) -> Array:
    """Times of an input's frames; landmarks of a video are not looked for."""
    if shown(clip) != clip.input:
        uniform, _ = evidence.resample(read(clip).evidence)
        return uniform.times_s
    capture = cv2.VideoCapture(clip.input)
    try:
        count, rate = capture.get(cv2.CAP_PROP_FRAME_COUNT), capture.get(cv2.CAP_PROP_FPS)
    finally:
        capture.release()
    if count < 2 or rate <= 0:
        raise InputError(f"{clip.input}: found {count:.0f} frames at {rate:g} Hz; valid: a whole video")
    times: Array = np.arange(int(count)) / (clip.fps or rate)
    return times


def survey(clip: Clip) -> dict[str, Any]:
    """What there is to do for a clip.

    Returns:
        `name` and `key`, `plan_key`, `video_s`, `frames`, `windows`; or `name` and the failure's `kind`,
        `message` and `trace`.
    """
    try:
        with quiet():
            (scene, plan), times = _settings(clip), _times_s(clip)
            clock = schedule.clock(times, plan.simulation.timestep_max_s)
            return {
                "name": clip.name,
                "key": key(clip, scene, plan),
                "plan_key": digest({"plan": plans.to_dict(plan), "code": code_digest()}),
                "video_s": float(times[-1] - times[0]),
                "frames": len(times),
                "windows": len(schedule.cut(clock, plan)),
            }
    except Exception as error:  # one clip that can't be read must not end a night of others
        return failure(clip.name, error)


def key(clip: Clip, scene: Scene, plan: Plan) -> str:
    """Hash of all that a clip's result depends on: files, plan, scene, options, versions and the code."""
    files = {name: getattr(clip, name) for name in ("input", "keypoints", "video", "camera")}
    meshes = [value for item in scene.items for value in item.parameters.values()]
    paths = [Path(scene.folder) / value for value in meshes if isinstance(value, str)]
    options = {name: value for name, value in asdict(clip).items() if name not in (*files, "name", "scene")}
    del options["plan"]
    content = {
        "files": {name: _hash(Path(path)) for name, path in files.items() if path is not None},
        "meshes": [_hash(path) for path in paths if path.is_file()],
        "scene": scenes.dumps(scene),
        "plan": plans.to_dict(plan),
        "options": options,
        "networks": _networks(clip),
        "versions": provenance.versions(),
        "code": code_digest(),
    }
    return digest(content)


def _networks(clip: Clip) -> list[str]:
    """Hashes of the weights that look for landmarks, where there are any to be looked for.

    Raises:
        InputError: they are not there.
    """
    videos = [path for path in (clip.input, clip.keypoints) if path is not None]
    if not any(Path(path).is_file() and evidence.is_video(path) for path in videos):
        return []
    return [weights.find(name)[1] for name in ("detector", clip.model or weights.best())]


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


def measure(clip: Clip, scratch: str) -> dict[str, float]:
    """What a short piece of a clip costs: two windows on one thread.

    Returns:
        `kinematics_s` (with the reading) per second of video, `first_s` and `window_s` of the first and a
        further window, `fixed_bytes`, and `bytes` per second of video.
    """
    began = time.perf_counter()
    inputs = read(clip)
    times = inputs.evidence.times_s
    reading_s = (time.perf_counter() - began) / float(times[-1] - times[0])
    length_s = inputs.plan.window.length_s + inputs.plan.window.commit_s
    piece = shortened(inputs.evidence, length_s)
    scene = inputs.scene
    if scene.ground.stiffness_Npm == scenes.FIT:
        scene = replace(scene, ground=replace(scene.ground, stiffness_Npm=None, damping_Nspm=None))
    with quiet():
        made = pipeline.reconstruct(piece, scene, inputs.plan, seed=clip.seed, threads=1)
        results.write(scratch, made, plan_name=clip.plan, seed=clip.seed, video=shown(clip))
    seconds = [window.seconds for window in made.windows]
    video_s = float(piece.times_s[-1] - piece.times_s[0])
    size = {path.name: path.stat().st_size for path in Path(scratch).iterdir()}
    growing = sum(size.get(name, 0) for name in (folder.MOTION, "overlay.mp4"))
    return {
        "kinematics_s": reading_s + made.seconds["kinematics"] / video_s,
        "first_s": seconds[0],
        "window_s": seconds[-1],
        "bytes": growing / video_s,
        "fixed_bytes": float(sum(size.values()) - growing),
    }


def shortened(given: Evidence, length_s: float) -> Evidence:
    """The first `length_s` of evidence, at least two frames."""
    count = max(2, int(np.searchsorted(given.times_s, given.times_s[0] + length_s + 1e-9, side="right")))
    return replace(
        given,
        times_s=given.times_s[:count],
        keypoints_px=given.keypoints_px[:count],
        scores=given.scores[:count],
        joints_m=given.joints_m[:count],
        rotations=None if given.rotations is None else given.rotations[:count],
        camera=None if given.camera is None else cameras.at(given.camera, slice(count)),
    )


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Rollouts that diverge are expected, and counted; MuJoCo would print each, and log it in a file here."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)
