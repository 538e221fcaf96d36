"""`simrecon synthesize`: what a person may do next, as motions that a run can follow."""

from __future__ import annotations

import argparse
from typing import Any

from simrecon import futures, plan
from simrecon.cli import arguments, options
from simrecon.cli.commands import purpose
from simrecon.cli.run import EXIT_FALLBACK
from simrecon.cli.stages import Stages
from simrecon.errors import InputError, printable
from simrecon.job import Job

TIME_RANGE_S = (-1e6, 1e6)


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    parser = arguments.command(commands, "synthesize", _synthesize, purpose("synthesize"))
    add_one = parser.add_argument
    add_one("source", metavar="RESULT|MOTION", help="result folder, or motion capture and the like")
    add_one("-o", dest="output", metavar="OUT", required=True, help="folder to write")
    add_one(
        "--at",
        type=arguments.number(TIME_RANGE_S),
        metavar="S",
        help="the moment after which [the last frame]",
    )
    add_one(
        "--samples", type=arguments.whole(futures.SAMPLES_MAX), default=10, metavar="N",
        help="how many futures [%(default)s]",
    )  # fmt: skip
    add_one("--simulate", action="store_true", help="run each future, into OUT/future_00 and so on")
    options.add(parser)


def _synthesize(parsed: argparse.Namespace) -> int:
    if parsed.planner is not None or parsed.engine is not None or parsed.contacts is not None:
        raise InputError("synthesize: found --planner, --engine or --contacts; valid: leave them out")
    job = options.apply(parsed, Job(parsed.source, parsed.output, plan=plan.read(futures.PLAN)))
    with Stages() as stages:
        made = futures.of_job(job, parsed.at, parsed.samples, stages, simulate=parsed.simulate)
    for path in made.files:
        print(f"written  {printable(str(path))}")
    print(f"written  {printable(str(made.folder / 'report.html'))}")
    lost = [result.folder for result in made.results if result.report["frames"]["fallback"]]
    if made.results:
        print(f"followed {len(made.results) - len(lost)} of {len(made.results)} to the end")
    return EXIT_FALLBACK if lost else 0
