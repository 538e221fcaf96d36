"""A run of a suite, made and scored; kept if it is there with the same input and settings."""

from __future__ import annotations

import json
import subprocess  # nosec B404  # runs the evaluator that the user names
import sys
import time
import traceback
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from simrecon import engines, kinematics
from simrecon import evidence as readers
from simrecon import plan as plans
from simrecon.bench import material
from simrecon.bench.task import BenchmarkTask
from simrecon.errors import SimreconError
from simrecon.evaluation import fitted, scores
from simrecon.io import atomic, full, reading
from simrecon.job import Job, Person, Reading
from simrecon.kinematics import world
from simrecon.plan import Plan
from simrecon.results import whole
from simrecon.results.verdict import is_plan
from simrecon.running import run
from simrecon.types import Evidence, Scene

RESULT, FIT, RECORD = "result", "fit.npz", "run.json"


def execute(task: BenchmarkTask) -> dict[str, Any]:
    """Run and score.

    Returns:
        `clip`, `variant`, `seed`, `status` (`done`, `kept` or `failed`), then `message` of a failure, or
        `key`, `scores` by motion, `intervals`, `run` (`schema.RUN_SCORES`) and `check` of the evaluator.

    Raises:
        DiskFullError: what is done is kept.
    """
    try:
        with full.told(task.folder):
            return _said(task) | _execute(task)
    except full.DiskFullError:
        raise
    except Exception as error:  # one clip that fails must not end a night of others
        expected = isinstance(error, SimreconError | OSError)  # the latter of a disk that fails
        return failed(task, str(error) if expected else traceback.format_exc(limit=-3))


def failed(task: BenchmarkTask, message: str) -> dict[str, Any]:
    """What `execute` returns of a run that failed."""
    return _said(task) | {"status": "failed", "message": " ".join(message.split())}


def _said(task: BenchmarkTask) -> dict[str, Any]:
    return {"clip": task.clip.name, "variant": task.variant.name, "seed": task.seed}


def _execute(task: BenchmarkTask) -> dict[str, Any]:
    file, truth = material.files(task)
    plan = material.plan(task)
    seen = material.read(task, file)
    # the scene is part of the clip, so it is placed from all of the evidence
    scene = material.scene(task, seen, plans.read(task.plan))
    key = material.key(file, task, plan, scene)
    if task.suite.half == "kinematics":
        return _fit(task, file, truth, key, _Work(seen, task.variant.drop, scene, plan))
    folder, mark = task.folder / RESULT, task.folder / RECORD
    status = "kept"
    before = _recorded(mark)
    if before.get("key") != key or whole.damage(folder, before.get("files")):
        mark.unlink(missing_ok=True)
        run(_job(task, file, scene, plan, folder), overwrite=True, keep=False)
        atomic.write_json(mark, {"key": key, "files": whole.note(folder)}, durable=True)
        status = "done"
    table = scores.score(folder, truth, file)
    content = table.as_dict()
    record = {"status": status, "key": key, "scores": table.values, "intervals": content["intervals"]}
    record["run"] = _run(folder)
    if task.evaluator is not None:
        command = [sys.executable, str(task.evaluator), str(folder), str(truth), str(file)]
        record["check"] = json.loads(subprocess.check_output(command, text=True))  # nosec B603  # no shell
        if "replay" in record["check"] and engines.simulates(task.variant.engine):
            record["run"]["check_qpos_error"] = float(record["check"]["replay"]["max_qpos_error"])
    return record


@dataclass(frozen=True, eq=False)
class _Work:
    """What a kinematic fit is made of, and what is left out of it."""

    evidence: Evidence
    drop: tuple[str, ...]
    scene: Scene
    plan: Plan


def _fit(task: BenchmarkTask, file: Path, truth: Path, key: str, work: _Work) -> dict[str, Any]:
    """The kinematic half alone, kept as `fit.npz`."""
    path, mark = task.folder / FIT, task.folder / RECORD
    status = "kept"
    before, size = _recorded(mark), path.stat().st_size if path.is_file() else None
    if size is None or (before.get("key"), before.get("bytes")) != (key, size):
        task.folder.mkdir(parents=True, exist_ok=True)
        mark.unlink(missing_ok=True)
        began = time.process_time()
        seen = material.dropped(work.evidence, work.drop)
        fit = kinematics.fit(readers.resample(seen)[0], work.scene, work.plan.kinematics)
        if "camera" in work.drop and seen.joints_frame != "world":
            fit = world.placed(fit, work.evidence.camera)
        fitted.write(path, fit, time.process_time() - began)
        atomic.flush(path)
        atomic.write_json(mark, {"key": key, "bytes": path.stat().st_size}, durable=True)
        status = "done"
    table = scores.score_fit(path, truth, file)
    record = {"status": status, "key": key, "scores": table.values, "intervals": table.as_dict()["intervals"]}
    return record | {"run": {"fit_cpu_per_second": fitted.read(path).seconds_per_second}}


def _job(task: BenchmarkTask, input_file: Path, scene: Scene, plan: Plan, folder: Path) -> Job:
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
        planner=task.variant.planner,
        engine=task.variant.engine,
        seed=task.seed,
        threads=task.threads,
        no_report=True,
    )


def _recorded(path: Path) -> dict[str, Any]:
    """What was written down of a run: its `key`."""
    try:
        record = json.loads(reading.read_text(path))
    except (OSError, ValueError, RecursionError):
        return {}
    return record if isinstance(record, dict) else {}


def _run(folder: Path) -> dict[str, float]:
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    totals, distance = report["totals"], report["agreement"]
    numbers = {
        "seconds_per_second": totals["seconds_per_second"],
        "cpu_per_second": totals["cpu_s"] / totals["video_s"],
        "stepping_share": totals["stepping_share"],
        "fallback": report["frames"]["fallback"],
        "replay_exact": report["audit"]["replay_exact"],
        "from_reference_mm": None if is_plan(report) else 1e3 * distance["fit_mean_m"],
        "from_reference_worst_mm": None if is_plan(report) else 1e3 * distance["fit_max_m"],
        **(report["planned"] or {}),
    }
    return {name: float(value) for name, value in numbers.items() if value is not None}
