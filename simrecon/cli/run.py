"""`simrecon run` and `simrecon demo`: the main job."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from simrecon import job as jobs
from simrecon import resources, running, scene
from simrecon.cli import arguments, options
from simrecon.cli.stages import Stages
from simrecon.errors import InputError
from simrecon.job import Job
from simrecon.results import Result
from simrecon.system.progress import duration

EXIT_FALLBACK = 3
DEMO_OUTPUT = "out/demo"


def add(commands: Any) -> None:
    """Add the commands to the subparsers of the program."""
    demo = arguments.command(commands, "demo", _demo, "run the example that ships with simrecon")
    demo.add_argument("-o", dest="output", metavar="OUT", help=f"result folder to write [{DEMO_OUTPUT}]")
    options.add(demo)

    run = arguments.command(commands, "run", _run, "reconstruct a simulated motion from a clip")
    run.add_argument(
        "input", metavar="INPUT", nargs="?", help="a video, evidence, a network's output or motion capture"
    )
    run.add_argument("-o", dest="output", metavar="OUT", help="result folder to write")
    run.add_argument("--job", metavar="FILE", help="job.toml of a result, or your own, instead of INPUT")
    options.add(run)


def _run(parsed: argparse.Namespace) -> int:
    return execute(options.apply(parsed, _asked(parsed)))


def _asked(parsed: argparse.Namespace) -> Job:
    """The job of a file, or of an input."""
    if parsed.job is not None:
        if parsed.input is not None:
            raise InputError(f"--job: found INPUT {parsed.input} beside it; valid: one of them")
        job = jobs.read(parsed.job)
        return job if parsed.output is None else replace(job, output=parsed.output)
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
    return execute(options.apply(parsed, job))


def execute(job: Job) -> int:
    """Run a job with its progress on stderr, print a summary, and return the exit status."""
    with Stages() as stages:
        result = running.run(job, stages)
    print(summary(result))
    return EXIT_FALLBACK if result.report["frames"]["fallback"] else 0


def summary(result: Result) -> str:
    """What a run came to, one line a fact."""
    report = result.report
    frames, totals, windows = report["frames"], report["totals"], report["windows"]
    simulated = f"{frames['simulated']} of {frames['count']} simulated"
    if frames["fallback"]:
        simulated += f", {frames['fallback']} on kinematic fallback"
    if frames["interpolated"]:
        simulated += f"; {frames['interpolated']} interpolated, the person was out of view"
    loss = f"{sum(w['loss'] for w in windows) / len(windows):.1f}, mean of the windows" if windows else "-"
    spent = f"{duration(totals['wall_s'])}, {duration(totals['seconds_per_second'])} per second of video"
    rows = {"frames": simulated, "loss": loss, "time": spent}
    if exchanged := report["input"]["exchanged"]:
        mixed = (f"{limbs} in frames {_spans(rows)}" for limbs, rows in exchanged.items())
        rows["sides"] = f"left and right were mixed up, and exchanged: {', '.join(mixed)}"
    if floor := report.get("soft_floor"):
        bound = ", an end of the search's range" if floor["at_bound"] else ""
        rows["floor"] = f"{floor['stiffness_Npm']:.3g} N/m{bound}, {floor['damping_Nspm']:.3g} N s/m"
    files = ", ".join(sorted(path.name for path in Path(result.folder).iterdir()))
    rows["written"] = f"{result.folder}: {files}"
    return "\n".join(f"{name:<9}{value}" for name, value in rows.items())


def _spans(frames: list[int]) -> str:
    """Increasing numbers as `3-5, 9`."""
    runs = np.split(np.array(frames), np.flatnonzero(np.diff(frames) > 1) + 1)
    return ", ".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else str(run[0]) for run in runs)
