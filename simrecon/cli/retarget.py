"""`simrecon retarget`: the motion of a finished result on another body, simulated."""

from __future__ import annotations

import argparse
from typing import Any

from simrecon import calls, results
from simrecon.cli import arguments, options
from simrecon.cli.commands import purpose
from simrecon.cli.run import execute
from simrecon.errors import InputError
from simrecon.job import Person
from simrecon.job.text import options as job_options


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    parser = arguments.command(
        commands,
        "retarget",
        _retarget,
        purpose("retarget"),
    )
    parser.add_argument("result", metavar="OUT", help="result folder whose kinematic motion is taken")
    parser.add_argument("-o", dest="output", metavar="NEW", required=True, help="result folder to write")
    options.add(parser, recalls=lambda name: name in ("plan", "scene"), sections=("", "person"))


def _retarget(parsed: argparse.Namespace) -> int:
    result = results.open_result(parsed.result)
    job = options.apply(parsed, calls.retarget_job(result, parsed.output))
    if job.person == Person():
        flags = [option.flag for option in job_options() if option.section == "person"]
        raise InputError(f"retarget: found no other body; valid: one or more of {', '.join(flags)}")
    return execute(job, parsed)
