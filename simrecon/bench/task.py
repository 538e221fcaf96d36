"""One run of a suite: a clip, a variant and a seed; kept if it is there with the same input and settings."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
import time
import traceback
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from simrecon import evidence as readers
from simrecon import kinematics, resources
from simrecon import plan as plans
from simrecon import scene as scenes
from simrecon.bench import places, plates
from simrecon.bench.schema import Clip, Suite, Variant
from simrecon.body import names
from simrecon.errors import SimreconError
from simrecon.evaluation import fitted, scores
from simrecon.io import atomic, provenance
from simrecon.job import Job, Person, Reading, inputs
from simrecon.plan import Plan
from simrecon.running import run
from simrecon.types import Evidence, Scene

RESULT, FIT, RECORD = "result", "fit.npz", "run.json"


@dataclass(frozen=True)
class Task:
    """What to run, and where.

    Attributes:
        suite: it is part of; clip, variant, seed: of it.
        data: folder of the clips.
        output: folder of the suite's runs.
        threads: of the simulator, 0 for one per core.
        evaluator: an independent script that is run as `evaluator RESULT TRUTH EVIDENCE`, or None.
    """

    suite: Suite
    clip: Clip
    variant: Variant
    seed: int
    data: Path
    output: Path
    threads: int = 0
    evaluator: Path | None = None

    @property
    def plan(self) -> str:
        """Name of the plan: the clip's, or the suite's."""
        return self.clip.plan or self.suite.plan

    @property
    def folder(self) -> Path:
        """Of this run."""
        return (
            self.output / "runs" / self.clip.name / self.variant.name.replace(" ", "_") / f"seed{self.seed}"
        )


def tasks(suite: Suite, data: Path, output: Path, evaluator: Path | None = None) -> list[Task]:
    """All runs of a suite, seeds last."""
    return [
        Task(suite, clip, variant, seed, data, output, evaluator=evaluator)
        for clip in suite.clip
        for variant in suite.variant
        for seed in suite.seeds
    ]


def execute(task: Task) -> dict[str, Any]:
    """Run and score.

    Returns:
        `clip`, `variant`, `seed`, `status` (`done`, `kept` or `failed`), then `message` of a failure, or
        `key`, `scores` by motion, `intervals`, `run` (`schema.RUN_SCORES`) and `check` of the evaluator.
    """
    try:
        return _said(task) | _execute(task)
    except Exception as error:  # one clip that fails must not end a night of others
        return failed(
            task, str(error) if isinstance(error, SimreconError) else traceback.format_exc(limit=-3)
        )


def failed(task: Task, message: str) -> dict[str, Any]:
    """What `execute` returns of a run that failed."""
    return _said(task) | {"status": "failed", "message": " ".join(message.split())}


def _said(task: Task) -> dict[str, Any]:
    return {"clip": task.clip.name, "variant": task.variant.name, "seed": task.seed}


def _execute(task: Task) -> dict[str, Any]:
    file, truth = _inputs(task)
    plan = _plan(task)
    seen = _read(task, file)
    # the scene is part of the clip, so it is placed from all of the evidence
    scene = _scene(task, seen, plans.read(task.plan))
    key = _key(file, task, plan, scene)
    if task.suite.half == "kinematics":
        return _fit(task, file, truth, key, _Work(dropped(seen, task.variant.drop), scene, plan))
    folder, mark = task.folder / RESULT, task.folder / RECORD
    status = "kept"
    if not (folder / "motion.npz").is_file() or _recorded(mark).get("key") != key:
        mark.unlink(missing_ok=True)
        run(_job(task, file, scene, plan, folder))
        atomic.write_json(mark, {"key": key})
        status = "done"
    table = scores.score(folder, truth, file)
    content = table.as_dict()
    record = {"status": status, "key": key, "scores": table.values, "intervals": content["intervals"]}
    record["run"] = _run(folder)
    if task.evaluator is not None:
        command = [sys.executable, str(task.evaluator), str(folder), str(truth), str(file)]
        record["check"] = json.loads(subprocess.check_output(command, text=True))
        if "replay" in record["check"]:
            record["run"]["check_qpos_error"] = float(record["check"]["replay"]["max_qpos_error"])
    return record


@dataclass(frozen=True, eq=False)
class _Work:
    """What a kinematic fit is made of."""

    evidence: Evidence
    scene: Scene
    plan: Plan


def _fit(task: Task, file: Path, truth: Path, key: str, work: _Work) -> dict[str, Any]:
    """The kinematic half alone, kept as `fit.npz`."""
    path, mark = task.folder / FIT, task.folder / RECORD
    status = "kept"
    if not path.is_file() or _recorded(mark).get("key") != key:
        task.folder.mkdir(parents=True, exist_ok=True)
        mark.unlink(missing_ok=True)
        began = time.process_time()
        fit = kinematics.fit(readers.resample(work.evidence)[0], work.scene, work.plan.kinematics)
        fitted.write(path, fit, time.process_time() - began)
        atomic.write_json(mark, {"key": key})
        status = "done"
    table = scores.score_fit(path, truth, file)
    record = {"status": status, "key": key, "scores": table.values, "intervals": table.as_dict()["intervals"]}
    return record | {"run": {"fit_cpu_per_second": fitted.read(path).seconds_per_second}}


def _job(task: Task, input_file: Path, scene: Scene, plan: Plan, folder: Path) -> Job:
    """The job of a run."""
    parts = task.variant.drop
    return Job(
        str(input_file),
        str(folder),
        reading=Reading(
            unknown_camera="camera" in parts, ignore=tuple(part for part in parts if part != "camera")
        ),
        person=Person(height_m=task.clip.height_m),
        scene=scene,
        plan=plan,
        seed=task.seed,
        threads=task.threads,
    )


def dropped(evidence: Evidence, parts: tuple[str, ...]) -> Evidence:
    """Evidence without its 2D landmarks (`keypoints`), 3D estimate (`joints`), or knowledge of its `camera`.

    Raises:
        InputError: nothing is left.
    """
    if "camera" in parts:
        evidence = readers.unknown_camera(evidence)
    return inputs.without(evidence, tuple(part for part in parts if part != "camera"), "drop")


def _inputs(task: Task) -> tuple[Path, Path]:
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


def _plan(task: Task) -> Plan:
    where = f"{task.suite.name}: variant {task.variant.name}"
    return plans.overridden(plans.read(task.plan), task.variant.plan, where)


def _read(task: Task, file: Path) -> Evidence:
    seen = readers.read(file)
    readers.check_names(seen, names.valid_names(), file)
    return seen if task.clip.height_m is None else replace(seen, height_m=task.clip.height_m)


def _scene(task: Task, seen: Evidence, plan: Plan) -> Scene:
    clip = task.clip
    if clip.place is not None:
        if clip.place.evidence is not None:
            seen = _read(task, task.data / clip.place.evidence)
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


def _key(file: Path, task: Task, plan: Plan, scene: Scene) -> str:
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
    if task.clip.height_m is not None:
        content["height_m"] = task.clip.height_m
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _recorded(path: Path) -> dict[str, Any]:
    """What was written down of a run: its `key`."""
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return record if isinstance(record, dict) else {}


def _run(folder: Path) -> dict[str, float]:
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    totals = report["totals"]
    numbers = {
        "seconds_per_second": totals["seconds_per_second"],
        "cpu_per_second": totals["cpu_s"] / totals["video_s"],
        "stepping_share": totals["stepping_share"],
        "fallback": report["frames"]["fallback"],
        "replay_exact": report["audit"]["replay_exact"],
    }
    return {name: float(value) for name, value in numbers.items() if value is not None}
