"""What a person may do next: futures of a result, or of a motion, as files that a run can follow."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from simrecon import job as jobs
from simrecon import kinematics, results, running, synthesis, viewer
from simrecon import plan as plans
from simrecon.errors import InputError
from simrecon.evidence import from_arrays, npz, resample
from simrecon.io import provenance
from simrecon.io.messages import hint
from simrecon.job import Job, Person, Reading, inputs
from simrecon.observer import SILENT, Observer
from simrecon.results import Result, kinematic
from simrecon.results.folder import MOTION
from simrecon.synthesis import Futures, Known, record
from simrecon.types import Evidence, Scene

PLAN = "quick"
SAMPLES_MAX = 1000
TRUST = "mocap,floor=scene"
"""Of the files: their joints are those of a body, and their floor is that of the scene."""
CHANGED = ("reading", "person", "scene", "plan", "threads", "style", "no_report")
"""Fields of a job that a synthesis takes: how a motion is read, and how futures are simulated."""


@dataclass(frozen=True, eq=False)
class Synthesis:
    """Futures that were written.

    Attributes:
        folder: where.
        futures: poses and predicted joints.
        files: evidence of each; results: of the simulations, none if nothing was to be simulated.
    """

    folder: Path
    futures: Futures
    files: tuple[Path, ...]
    results: tuple[Result, ...] = ()


def synthesize(
    source: Path | str,
    output: Path | str,
    *,
    at_s: float | None = None,
    samples: int = 10,
    seed: int = 0,
    simulate: bool = False,
    observer: Observer = SILENT,
    **changes: Any,
) -> Synthesis:
    """Predict the two seconds after a moment of a motion, several times (Xie 2021, section 3.4).

    Args:
        source: a result, or a file with a motion, which is fitted first.
        output: folder to write: `future_00.npz`, …, `synthesis.json`, `report.html`.
        at_s: the moment; None: the last frame. The half second before it must be known.
        samples: how many futures; the first ten are of ten modes.
        seed: of the draws.
        simulate: run each future, into `future_00`, ….
        observer: is told of the progress.
        changes: fields of a `Job`: `reading`, `person` and `scene` of a file; `plan` and `threads` of the
            simulations.

    Raises:
        InputError: the source can't be used, does not hold the half second before, or there is no such field.
    """
    if unknown := [name for name in changes if name not in CHANGED]:
        near = hint(unknown[0], CHANGED)
        raise InputError(f"synthesize: found the field {unknown[0]!r}{near}; valid: {', '.join(CHANGED)}")
    job = Job(str(source), str(output), plan=plans.read(PLAN), seed=seed)
    return of_job(replace(job, **changes), at_s, samples, observer, simulate=simulate)


def of_job(
    job: Job, at_s: float | None, samples: int, observer: Observer = SILENT, *, simulate: bool = False
) -> Synthesis:
    """As `synthesize`; `job` holds source, output, seed, and all else that is said of them."""
    job = jobs.checked(job)
    if not 1 <= samples <= SAMPLES_MAX:
        raise InputError(f"--samples: found {samples}; valid: a whole number from 1 to {SAMPLES_MAX}")
    folder = Path(job.output)
    _check_target(folder, samples)
    ours = record.earlier(folder)
    result = _result(job, at_s, observer, overwrite=bool(ours))
    motion, body = result.motion, result.body
    qpos = motion.qpos[:, : kinematic.coordinates(body)]
    known = Known(body, result.scene, motion.times_s, qpos)
    moment = float(motion.times_s[-1]) if at_s is None else at_s
    observer.stage("futures", 0.0, 1.0)
    futures = synthesis.predict(known, moment, samples, job.seed, plans.read(PLAN).kinematics)
    observer.stage("futures", 1.0, 1.0)
    shown = viewer.Ghosts(futures.times_s - float(motion.times_s[0]), futures.qpos)
    page = viewer.render(result, alone=True, ghosts=shown)
    contents = (*(npz.dumps(seen) for seen in _evidence(futures)), page.encode("utf-8"))
    files = dict(zip(record.names(samples), contents, strict=True))
    versions = provenance.versions()
    record.write(folder, files, source=str(job.input), at_s=moment, seed=job.seed, versions=versions)
    paths = tuple(folder / record.name(row, samples) for row in range(samples))
    asked = paths if simulate else ()
    done = tuple(_simulated(job, one, futures, observer, overwrite=one.name in ours) for one in asked)
    return Synthesis(folder, futures, paths, done)


def _check_target(folder: Path, samples: int) -> None:
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: found a file; valid: a folder")
    if (folder / MOTION).exists():
        raise InputError(f"{folder}: holds a result, which would be lost; valid: another folder")
    record.check(folder, samples)


def _result(job: Job, at_s: float | None, observer: Observer, *, overwrite: bool) -> Result:
    """The source as a result: what is a file is fitted, not simulated, if it holds the moment.

    `overwrite`: one that an earlier synthesis has fitted is replaced even if it is better.
    """
    if not Path(job.input).is_dir() or not (Path(job.input) / MOTION).is_file():
        times_s = resample(inputs.observe(job))[0].times_s
        synthesis.check_moment(times_s, float(times_s[-1]) if at_s is None else at_s)
        fitted = replace(
            job, output=str(Path(job.output) / "motion"), planner="none", engine="none", no_report=True
        )
        return running.run(fitted, observer, overwrite=overwrite)
    usual = {"reading": Reading(), "person": Person(), "scene": Scene()}
    said = [name for name, value in usual.items() if getattr(job, name) != value]
    if said:
        raise InputError(
            f"{job.input}: found options of the {' and the '.join(said)} for a result, which says all of it; "
            "valid: leave them out"
        )
    return results.open_result(job.input)


def _evidence(futures: Futures) -> Iterator[Evidence]:
    """All points of the body in each future, as motion capture over the scene's floor."""
    body = futures.body
    for qpos in futures.qpos:
        yield from_arrays(
            futures.times_s,
            joint_names=body.skeleton.point_names,
            joints_m=kinematics.configurations(body, qpos)[1],
            height_m=body.height_m,
            mass_kg=body.mass_kg,
            trust=TRUST,
        )


def _simulated(job: Job, path: Path, futures: Futures, observer: Observer, *, overwrite: bool) -> Result:
    asked = {
        item.name: getattr(job, item.name)
        for item in dataclasses.fields(Job)
        if item.name in ("plan", "seed", "threads", "style", "no_report")
    }
    run = Job(str(path), str(path.with_suffix("")), scene=futures.scene, **asked)
    return running.run(run, observer, overwrite=overwrite)
