"""What a clip is made from: read, hashed, and measured on a short piece."""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from simrecon import evidence, reconstruct, results, schedule
from simrecon import plan as plans
from simrecon import scene as scenes
from simrecon.batch.clips import Clip
from simrecon.batch.failures import failure
from simrecon.bench.task import code_digest
from simrecon.body import names
from simrecon.evidence import lens
from simrecon.plan import Plan
from simrecon.results import folder, overlay, report
from simrecon.types import Evidence, Scene


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
        with quiet():
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
    with quiet():
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


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Rollouts that diverge are expected, and counted; MuJoCo would print each, and log it in a file here."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)
