"""Everybody in a video, each with evidence and a result of their own, in one world.

The job is run for one person after the other, those first who are seen best. The world is that of the first
result: its camera, lens and place over the floor, is kept in a file beside the results, through which all
others are seen. Nobody knows of the others in the simulation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from simrecon import running
from simrecon.errors import InputError, SimreconError
from simrecon.evidence.video import survey
from simrecon.io import atomic, reading, toml
from simrecon.io.messages import counted
from simrecon.job import Job, looking
from simrecon.observer import SILENT, Observer
from simrecon.results import Result, folder
from simrecon.types import Report

SEEN_MIN = 0.25
"""Share of the frames that are looked at, in which somebody has to be for a result of their own."""
CAMERA = "shared_camera.toml"
"""Where the camera of the first result is kept, for the others."""
MADE = "# Made by simrecon, and made again by the next run here.\n"
"""The first line of it; a file without it is somebody's own, and stays."""
_PERSONAL = {"height_m": "--height-m", "mass_kg": "--mass-kg", "betas": "--betas"}


@dataclass(frozen=True, eq=False)
class Outcome:
    """What came of one person.

    Attributes:
        number: of the person, 1 for the one who is seen best.
        result: None if there is none.
        error: why there is none.
    """

    number: int
    result: Result | None
    error: SimreconError | None = None


def run_people(job: Job, observer: Observer = SILENT, *, overwrite: bool = False) -> tuple[Outcome, ...]:
    """Run a job once for each person of its video; one who fails keeps nobody else from a result.

    Args:
        job: of a video, with `all` for a person; its output is the folder of the folders `person1`, ….
        observer: is told of the progress, and may stop the run.
        overwrite: as of `run`.

    Returns:
        One for each who is in at least a quarter of the frames that are looked at, by number.

    Raises:
        InputError: something that the job names can't be used; nothing was written.
    """
    _check(job)
    running.check(_of(job, 1))
    numbers = _numbers(_of(job, 1), observer)
    camera: Path | None = None
    outcomes = []
    for number in numbers:
        observer.note(f"person {number}, to {_of(job, number).output}")
        own = _of(job, number) if camera is None else _seen_through(_of(job, number), camera)
        try:
            result = running.run(own, observer, overwrite=overwrite)
        except SimreconError as error:
            observer.note(f"person {number} failed: {error}")
            outcomes.append(Outcome(number, None, error))
            continue
        outcomes.append(Outcome(number, result))
        if camera is None:
            camera = _keep(result.report, Path(job.output) / CAMERA)
    return tuple(outcomes)


def _check(job: Job) -> None:
    """Refuse what can only be said of one person, and a folder that is a result itself.

    Raises:
        InputError: names it.
    """
    if not looking.asks_for_all(job):
        found = f"{job.reading.person!r} for {job.input}"
        raise InputError(f"--person: found {found}; valid: {looking.EVERYBODY}, with a video")
    said = [flag for name, flag in _PERSONAL.items() if getattr(job.person, name) is not None]
    said += ["--contacts"] if job.contacts else []
    said += ["--person-at"] if job.reading.person_at_px is not None else []
    if said:
        raise InputError(f"{said[0]}: found beside --person all; valid: a run of one person")
    output = Path(job.output)
    if output.is_file() or folder.holds_result(output):
        what = "a file" if output.is_file() else "a result"
        raise InputError(f"{job.output}: found {what}; valid: a folder for the results of several people")


def _of(job: Job, number: int) -> Job:
    """The job of one person."""
    output = str(Path(job.output) / folder.person(number))
    return replace(job, output=output, reading=replace(job.reading, person=str(number)))


def _numbers(job: Job, observer: Observer) -> list[int]:
    """Who is seen often enough, the first one in any case."""
    stage = partial(observer.stage, f"landmarks of {Path(job.input).name}")
    detected = looking.first(job, stage)
    indices = detected.sightings[:, 1].astype(int)
    often = math.ceil(SEEN_MIN * len(detected.looked))
    count = np.bincount(indices, minlength=1)
    numbers = [i + 1 for i, seen in enumerate(count) if i == 0 or seen >= often]
    known = survey.described(detected.sightings, len(detected.looked)) or "nobody for certain"
    observer.note(f"{counted(len(numbers), 'person', 'people')} of {len(count)} to reconstruct: {known}")
    return numbers


def _keep(report: Report, path: Path) -> Path | None:
    """Write the camera of a result, where it first stands; None where the user has said it."""
    camera = report["camera"]
    if camera is None or report["assumed"]["camera"]["origin"] == "given":
        return None
    place = np.vstack((camera["world_to_camera"][0], [0.0, 0.0, 0.0, 1.0]))
    table = {
        "image_size_px": [int(side) for side in camera["image_size_px"]],
        "matrix_px": np.asarray(camera["K"], float).tolist(),
        "distortion": np.asarray(camera["dist"], float).tolist(),
        "world_to_camera": place.tolist(),
    }
    names = (path.with_stem(f"{path.stem}{end}") for end in ("", *(f"-{i}" for i in range(2, 1000))))
    path = next(one for one in names if _is_ours(one))
    atomic.write_text(path, MADE + toml.dumps(table))
    return path


def _is_ours(path: Path) -> bool:
    """Whether a camera may be written there: nothing is, or one of ours."""
    return not path.exists() or (path.is_file() and reading.read_bytes(path).startswith(MADE.encode()))


def _seen_through(job: Job, camera: Path) -> Job:
    """The job with a camera of a file, whose lens and place nothing else says."""
    reading = replace(
        job.reading,
        camera=str(camera.resolve()),
        camera_name=None,
        fov_deg=None,
        size_px=None,
        unknown_camera=False,
        up=None,
    )
    return replace(job, reading=reading)
