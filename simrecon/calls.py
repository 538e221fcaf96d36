"""What commands beside `run` do, as plain calls: `rerun`, `retarget`, `suggest`."""

from __future__ import annotations

import dataclasses
from dataclasses import replace
from pathlib import Path
from typing import Any

from simrecon import evidence as readers
from simrecon import results, running, suggesting
from simrecon.errors import InputError
from simrecon.io.messages import hint
from simrecon.job import Job, Person, request
from simrecon.observer import SILENT, Observer
from simrecon.results import Result, recall
from simrecon.scene.suggest import Suggestion
from simrecon.types import Evidence, Scene

OWN = ("output", "detected", "start", "retarget", "sha256")
"""Fields of a job that follow from the result."""
FILES = {"reading": ("keypoints", "camera"), "person": ("body_model",)}
"""Files of a job that are taken as they are now where a field of it is given anew."""


def rerun(
    result: Result | Path | str,
    output: Path | str,
    observer: Observer = SILENT,
    *,
    overwrite: bool = False,
    **changes: Any,
) -> Result:
    """Simulate a finished result again, starting from its motion.

    Args:
        result: opened, or its folder.
        output: folder of the new result.
        observer: as of `run`.
        overwrite: as of `run`.
        changes: fields of the `Job` that are to be others, such as `scene`; the rest is as before.

    Raises:
        InputError: there is no such field, or what `run` raises.
    """
    opened = result if isinstance(result, Result) else results.open_result(result)
    before = replace(recall.job_of(opened), output=str(output))
    again = _changed(before, changes, "rerun")
    if request.detected_by(before) != request.detected_by(again) or "input" in changes:
        again = replace(again, detected=None)
    if again.reading.from_s != before.reading.from_s:
        again = replace(again, start=None)
    return running.run(again, observer, overwrite=overwrite)


def retarget(
    result: Result | Path | str,
    output: Path | str,
    person: Person,
    observer: Observer = SILENT,
    *,
    overwrite: bool = False,
    **changes: Any,
) -> Result:
    """Put the kinematic motion of a finished result on another body, and simulate it.

    Args:
        result: whose motion it is, or its folder.
        output: as of `rerun`.
        person: the other body: what of it is not given is as before.
        observer: is told of the progress.
        overwrite: replace a better result too.
        changes: fields of the `Job` that are to be others, such as `plan`.

    Raises:
        InputError: no other body is given, there is no such field, or what `run` raises.
    """
    if person == Person():
        valid = ", ".join(item.name for item in dataclasses.fields(Person))
        raise InputError(f"retarget: found no other body; valid: a Person with one or more of {valid}")
    opened = result if isinstance(result, Result) else results.open_result(result)
    job = replace(retarget_job(opened, output), person=person)
    return running.run(_changed(job, changes, "retarget"), observer, overwrite=overwrite)


def retarget_job(result: Result, output: Path | str) -> Job:
    """The job that retargets a result in its own scene; whom to is not yet said."""
    known = result.job.sha256 if result.scene.items else {}  # of the meshes
    return Job(
        str(result.folder), str(output), scene=result.scene, plan=result.plan, retarget=True, sha256=known
    )


def suggest(
    evidence: Evidence | Path | str, scene: Scene | None = None, person: Person | None = None
) -> tuple[Suggestion, ...]:
    """Supports that a motion needs where the scene has none: a seat, a bed, a beam, a step.

    Args:
        evidence: as `read_evidence` gives it, or its file.
        scene: what is known already; None: a floor at z = 0.
        person: what is known of the person.

    Returns:
        Each with an `item` for the scene, `why`, and the frames of the uniform clock that show it.

    Raises:
        InputError: the evidence can't be read or fitted.
    """
    seen = evidence if isinstance(evidence, Evidence) else readers.read(evidence)
    return suggesting.suggestions(seen, scene or Scene(), person or Person())[1]


def _changed(job: Job, changes: dict[str, Any], who: str) -> Job:
    """The job with other fields, whose files are taken as they are now."""
    fields = [item.name for item in dataclasses.fields(Job) if item.name not in OWN]
    for name in changes:
        if name not in fields:
            near, valid = hint(name, fields), ", ".join(fields)
            raise InputError(f"{who}: found the field {name!r}{near}; valid: {valid}")
    again = replace(job, **changes)
    named = [name for field in changes for name in (field, *FILES.get(field, ()))]
    meshes = request.meshes_of(again) if "scene" in changes else ()
    return request.taken_anew(again, (*named, *meshes))
