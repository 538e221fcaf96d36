"""The job of a run: what was opened, with scene, contacts, plan and range as they are set in the studio."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from simrecon import job as jobs
from simrecon import plan as plans
from simrecon.errors import InputError
from simrecon.io import atomic
from simrecon.job import Job, request
from simrecon.results import Result, recall
from simrecon.studio.document import Document
from simrecon.types import Scene


@dataclass(frozen=True)
class Wanted:
    """How a run is to be done.

    Attributes:
        plan: by name, or a path.
        from_s, to_s: part of the clip; None: as it was opened.
        onwards: begin with the finished motion, where there is one, as `simrecon rerun`.
        seed: of all random numbers; None: as it was opened.
    """

    plan: str = "quick"
    from_s: float | None = None
    to_s: float | None = None
    onwards: bool = True
    seed: int | None = None


def job_of(base: Result | Job, document: Document, wanted: Wanted, output: Path | str) -> Job:
    """The job of a run.

    Args:
        base: result that was opened, or the job of reading evidence.
        document: scene and wishes.
        wanted: all else.
        output: folder of the new result.

    Raises:
        InputError: there is no such plan.
    """
    if isinstance(base, Result):
        job = recall.job_of(base)
        scene = _ground_as_asked(document.scene, base)
    else:
        job, scene = base, document.scene
    reading = replace(
        job.reading,
        from_s=job.reading.from_s if wanted.from_s is None else wanted.from_s,
        to_s=job.reading.to_s if wanted.to_s is None else wanted.to_s,
    )
    same_start = reading.from_s == job.reading.from_s
    again = replace(
        job,
        output=str(output),
        scene=scene,
        contacts=document.edits.wishes,
        plan=plans.read(wanted.plan),
        reading=reading,
        seed=job.seed if wanted.seed is None else wanted.seed,
        start=job.start if wanted.onwards and same_start else None,
        detected=job.detected if reading == job.reading else None,
    )
    return request.taken_anew(again, request.meshes_of(again))


def _ground_as_asked(scene: Scene, base: Result) -> Scene:
    """A floor that the fit had put at its height, and that was not edited, is found again."""
    if scene.ground != base.scene.ground:
        return scene
    return replace(scene, ground=recall.scene_of(base).ground)


def save(job: Job, path: Path | str, private: Path) -> Job:
    """Write `job.toml`, with the hashes of all files that it reads; a start in the cache is put beside it.

    Args:
        job: of a run.
        path: where the user wants it.
        private: folder whose files do not last.

    Raises:
        InputError: it can't be written.
    """
    target = Path(path)
    if target.suffix != ".toml":
        raise InputError(f"{path}: is no .toml; valid: a name that ends in .toml")
    with atomic.reported(target):
        if job.start is not None and private.resolve() in Path(job.start).resolve().parents:
            beside = target.with_name(f"{target.stem}.start.npz").resolve()
            atomic.write_bytes(beside, Path(job.start).read_bytes())
            job = request.moved(job, "start", str(beside))
        job = jobs.absolute(replace(job, sha256=request.hashes(job)))
        atomic.write_bytes(target, jobs.dumps(job).encode("utf-8", "surrogateescape"))
    return job
