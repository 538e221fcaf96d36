"""What a run is made from: evidence and reference, plan and scene, and the hash of all of them."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path

from simrecon import evidence as readers
from simrecon import plan as plans
from simrecon import resources
from simrecon import scene as scenes
from simrecon.bench import places, plates
from simrecon.bench.task import BenchmarkTask
from simrecon.body import names
from simrecon.io import provenance
from simrecon.job import inputs
from simrecon.plan import Plan
from simrecon.types import Evidence, Scene


def files(task: BenchmarkTask) -> tuple[Path, Path]:
    """Evidence and reference; those of a trial are made, in a folder of their own."""
    clip = task.clip
    if clip.trial is None:
        return task.data / str(clip.evidence), task.data / str(clip.truth)
    trial = clip.trial
    folder = task.output / "trials" / clip.name / f"{task.variant.name.replace(' ', '_')}_{task.seed}"
    folder.mkdir(parents=True, exist_ok=True)
    return plates.make(
        folder,
        task.data / trial.markers,
        task.data / trial.static,
        task.data / trial.forces,
        mass_kg=trial.mass_kg,
        cutoff_hz=trial.cutoff_hz,
        below_m=trial.below_m,
        feet_on_plates=trial.feet_on_plates,
        span_s=None if trial.span_s is None else (trial.span_s[0], trial.span_s[1]),
    )


def plan(task: BenchmarkTask) -> Plan:
    """The plan of a run, as its variant changes it."""
    where = f"{task.suite.name}: variant {task.variant.name}"
    return plans.overridden(plans.read(task.plan), task.variant.plan, where)


def read(task: BenchmarkTask, file: Path) -> Evidence:
    """Evidence of the clip, with the height that the suite gives."""
    seen = readers.read(file)
    readers.check_names(seen, names.valid_names(), file)
    return seen if task.clip.height_m is None else replace(seen, height_m=task.clip.height_m)


def scene(task: BenchmarkTask, seen: Evidence, plan: Plan) -> Scene:
    """The scene of the clip, placed from its evidence where the suite says so."""
    clip = task.clip
    if clip.place is not None:
        if clip.place.evidence is not None:
            seen = read(task, task.data / clip.place.evidence)
        if clip.place.kind == "seat":
            return places.seat(seen, plan.kinematics)
        if clip.place.kind == "support":
            return places.support(seen, plan.kinematics)
        return places.platform(seen, float(clip.place.height_m or 0.0))
    if clip.scene is None:
        return Scene()
    if clip.scene.startswith("example/"):
        return scenes.read(resources.folder("example") / clip.scene.removeprefix("example/"))
    return scenes.read(task.suite.folder / clip.scene)


def dropped(evidence: Evidence, parts: tuple[str, ...]) -> Evidence:
    """Evidence without its 2D landmarks (`keypoints`), 3D estimate (`joints`), or knowledge of its `camera`.

    Raises:
        InputError: nothing is left.
    """
    if "camera" in parts:
        evidence = readers.unknown_camera(evidence)
    return inputs.without(evidence, tuple(part for part in parts if part != "camera"), "drop")


def key(file: Path, task: BenchmarkTask, plan: Plan, scene: Scene) -> str:
    """Hash of all that a motion depends on: input, settings, versions and the code itself."""
    content = {
        "evidence": hashlib.sha256(file.read_bytes()).hexdigest(),
        "drop": task.variant.drop,
        "plan": plans.to_dict(plan),
        "scene": scenes.dumps(scene),
        "seed": task.seed,
        "versions": provenance.versions(),
        "code": provenance.code_digest(),
    }
    if task.variant.planner is not None:
        content["planner"] = task.variant.planner
    if task.variant.engine != "sampling":
        content["engine"] = task.variant.engine
    if task.clip.height_m is not None:
        content["height_m"] = task.clip.height_m
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
