"""`simrecon rerun`: a finished result again, in an edited scene or with other options."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from simrecon import results
from simrecon.cli import arguments, options
from simrecon.cli.run import execute
from simrecon.errors import InputError
from simrecon.job import Job, request
from simrecon.results import Result
from simrecon.results.folder import MOTION


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    rerun = arguments.command(
        commands, "rerun", _rerun, "simulate a finished result again, starting from its motion"
    )
    rerun.epilog = (
        "Takes every option of run, such as --scene for another scene; what is not given is as before."
    )
    rerun.add_argument("result", metavar="OUT", help="result folder to start from")
    rerun.add_argument("-o", dest="output", metavar="OUT2", help="result folder to make")
    rerun.add_argument("--input", metavar="FILE", help="where the input is now, if it was moved")
    options.add(rerun, recalls=lambda _: True)


def _rerun(parsed: argparse.Namespace) -> int:
    if parsed.output is None:
        raise InputError("rerun: found no -o; valid: -o OUT2, the folder of the new result")
    result = results.open_result(parsed.result)
    job = replace(recalled(result), output=parsed.output)
    again = options.apply(parsed, job)
    if _reads_anew(job, again):
        again = replace(again, detected=None)
    if parsed.input is not None:
        name = "input" if again.detected is None else "detected"
        again = request.moved(again, name, parsed.input)
    _check_there(again, parsed.result)
    if again.reading.from_s != job.reading.from_s:
        print("another --from than before: begins with the kinematic fit", file=sys.stderr)
        again = replace(again, start=None)
    said = options.given(parsed)
    again = replace(again, estimated=tuple(name for name in again.estimated if name not in said))
    return execute(again, parsed)


def _reads_anew(before: Job, after: Job) -> bool:
    """Whether the landmarks that were found in a video are not those that the options now select."""
    return replace(before.reading, ignore=()) != replace(after.reading, ignore=())


def recalled(result: Result) -> Job:
    """The job of a result, to be done again from its motion on, for a person of the size that was fitted."""
    job, person = result.job, result.report["person"]
    size = replace(job.person, height_m=person["height_m"], mass_kg=person["mass_kg"])
    assumed = result.report.get("assumed", {})  # results of earlier versions have none
    origins = {f"{name}_{unit}": assumed.get(name, {}) for name, unit in (("height", "m"), ("mass", "kg"))}
    job = replace(
        job,
        scene=result.scene,
        person=size,
        estimated=tuple(name for name, of in origins.items() if of.get("origin") == "estimated"),
        start=str(result.folder / MOTION),
    )
    return request.taken_anew(job, ("start", *request.meshes_of(job)))


def _check_there(job: Job, result: str) -> None:
    source = job.detected or job.input
    if not Path(source).exists():
        raise InputError(f"{source}: the evidence of {result} is not there; --input says where it is")
