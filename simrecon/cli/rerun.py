"""`simrecon rerun`: a finished result again, in an edited scene or with other options."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

from simrecon import results
from simrecon.cli import arguments, options
from simrecon.cli.commands import purpose
from simrecon.cli.run import execute, worst
from simrecon.errors import InputError
from simrecon.job import Job, inputs, request
from simrecon.results import folder, recall


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    rerun = arguments.command(commands, "rerun", _rerun, purpose("rerun"))
    rerun.epilog = (
        "Takes every option of run, such as --scene for another scene; what is not given is as before."
    )
    rerun.add_argument("result", metavar="OUT", help="result folder to start from")
    rerun.add_argument("-o", dest="output", metavar="OUT2", help="result folder to make")
    rerun.add_argument("--input", metavar="FILE", help="where the input is now, if it was moved")
    options.add(rerun, recalls=lambda _: True, forgets=True)


def _rerun(parsed: argparse.Namespace) -> int:
    if parsed.output is None:
        raise InputError("rerun: found no -o; valid: -o OUT2, the folder of the new result")
    several = folder.people(Path(parsed.result))
    if not several:
        return _one(parsed, parsed.result, parsed.output)
    return worst(_one(parsed, str(one), str(Path(parsed.output) / one.name)) for one in several)


def _one(parsed: argparse.Namespace, path: str, output: str) -> int:
    """Run one result again."""
    result = results.open_result(path)
    job = replace(recall.job_of(result), output=output)
    again = options.apply(parsed, job)
    if parsed.input is not None:
        again = _moved(again, parsed.input)
    _check_there(again, path)
    return execute(again, parsed)


def _moved(job: Job, path: str) -> Job:
    """The job with its input in another place: a video, or else the landmarks that were kept of it.

    Landmarks that are lost are found anew in the video.
    """
    if job.detected is None or not inputs.is_video(replace(job, input=path)):
        return request.moved(job, "input" if job.detected is None else "detected", path)
    kept = job.detected if Path(job.detected).exists() else None
    return replace(request.moved(job, "input", path), detected=kept)


def _check_there(job: Job, result: str) -> None:
    for source in filter(None, (job.detected, job.input)):
        if not Path(source).exists():
            raise InputError(f"{source}: the evidence of {result} is not there; --input says where it is")
