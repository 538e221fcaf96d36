"""`simrecon run` and `simrecon demo`: the main job."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from simrecon import job as jobs
from simrecon import people, resources, running, scene
from simrecon.cli import arguments, options, summary
from simrecon.cli.commands import purpose
from simrecon.cli.stages import Stages
from simrecon.errors import InputError
from simrecon.job import Job, looking
from simrecon.results import Result

EXIT_FAILED, EXIT_FALLBACK = 1, 3
DEMO_OUTPUT = "out/demo"


def add(commands: Any) -> None:
    """Add the commands to the subparsers of the program."""
    demo = arguments.command(commands, "demo", _demo, purpose("demo"))
    demo.add_argument("-o", dest="output", metavar="OUT", help=f"result folder to write [{DEMO_OUTPUT}]")
    options.add(demo)

    run = arguments.command(commands, "run", _run, purpose("run"))
    run.add_argument(
        "input", metavar="INPUT", nargs="?", help="a video, evidence, a network's output or motion capture"
    )
    run.add_argument("-o", dest="output", metavar="OUT", help="result folder to write")
    run.add_argument("--job", metavar="FILE", help="job.toml of a result, or your own, instead of INPUT")
    options.add(run, forgets=True)


def _run(parsed: argparse.Namespace) -> int:
    return execute(options.apply(parsed, _asked(parsed)), parsed)


def _asked(parsed: argparse.Namespace) -> Job:
    """The job of a file, or of an input."""
    if parsed.job is not None:
        if parsed.input is not None:
            raise InputError(f"--job: found INPUT {parsed.input} beside it; valid: one of them")
        job = jobs.read(parsed.job)
        return job if parsed.output is None else replace(job, output=parsed.output)
    if parsed.forget is not None:
        raise InputError("--forget: found no --job, whose options it is for; valid: leave it out")
    if parsed.input is None or parsed.output is None:
        raise InputError("run needs INPUT and -o OUT, or --job FILE; `simrecon run -h` shows what is valid")
    return Job(parsed.input, parsed.output)


def _demo(parsed: argparse.Namespace) -> int:
    folder = resources.folder("example")
    job = Job(
        str(folder / "beam.npz"),
        parsed.output or DEMO_OUTPUT,
        video=str(folder / "beam.mp4"),
        scene=scene.read(folder / "beam.toml"),
    )
    return execute(options.apply(parsed, job), parsed)


def execute(job: Job, parsed: argparse.Namespace) -> int:
    """Run a job with its progress on stderr, print a summary, and return the exit status."""
    if looking.asks_for_all(job):
        return _everybody(job, parsed)
    with Stages() as stages:
        result = running.run(job, stages, overwrite=parsed.replace)
    print(summary.of(result))
    return _status(result)


def _everybody(job: Job, parsed: argparse.Namespace) -> int:
    """The same for each person of a video; the exit status is the worst of them."""
    with Stages() as stages:
        outcomes = people.run_people(job, stages, overwrite=parsed.replace)
    for outcome in outcomes:
        print(f"\nperson {outcome.number} of {len(outcomes)}")
        print(f"failed   {outcome.error}" if outcome.result is None else summary.of(outcome.result))
    return worst(EXIT_FAILED if one.result is None else _status(one.result) for one in outcomes)


def _status(result: Result) -> int:
    return EXIT_FALLBACK if result.report["frames"]["fallback"] else 0


def worst(statuses: Iterable[int]) -> int:
    """The exit status of several runs: failed before on fallback before simulated."""
    return max(statuses, key=(0, EXIT_FALLBACK, EXIT_FAILED).index, default=0)
