"""`simrecon run` and `simrecon demo`: the main job."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from simrecon import evidence, pipeline, plan, resources, results, scene, softfloor
from simrecon.body import Wanted, mass, model_file, names, shape
from simrecon.body.shape import ShapeSpace
from simrecon.cli import arguments, reading
from simrecon.drawing import overlay
from simrecon.evidence.npz import HEIGHT_RANGE_M, MASS_RANGE_KG
from simrecon.system.progress import Progress, duration
from simrecon.types import Array, Evidence, KinematicFit, Motion, Report, Scene

EXIT_FALLBACK = 3
ENGINES = ("sampling",)
LARGEST_SEED = 2**63 - 1


def add(commands: Any) -> None:
    """Add the commands to the subparsers of the program."""
    demo = arguments.command(commands, "demo", _demo, "the main job on the example that ships with simrecon")
    demo.add_argument(
        "-o", dest="output", metavar="OUT", default="out/demo", help="result folder [%(default)s]"
    )
    _add_settings(demo)

    run = arguments.command(commands, "run", _run, "from evidence to a simulated motion")
    run.add_argument("input", metavar="INPUT", help="a video, evidence, a network's output or motion capture")
    run.add_argument("-o", dest="output", metavar="OUT", required=True, help="result folder, which is made")
    _add_settings(run)
    reading.add(run)
    run.add_argument("--engine", choices=ENGINES, default=ENGINES[0], help="optimiser [%(default)s]")
    run.add_argument("--scene", metavar="FILE", help="floor and things (scene.toml) [a floor at z = 0]")
    run.add_argument("--video", metavar="FILE", help="what the overlay is drawn on [plain ground]")
    _add_body(run)


def _add_body(parser: argparse.ArgumentParser) -> None:
    """Options of every command that makes a body."""
    parser.add_argument(
        "--height-m", type=arguments.number(HEIGHT_RANGE_M), metavar="M", help="the person's height"
    )
    parser.add_argument(
        "--mass-kg", type=arguments.number(MASS_RANGE_KG), metavar="KG", help="the person's mass"
    )
    parser.add_argument(
        "--betas",
        type=arguments.numbers,
        metavar="B,…",
        help="shape parameters, the first ones; --betas=-1,… if the first is negative [as measured]",
    )
    parser.add_argument(
        "--body-model",
        metavar="FILE",
        help="whose shapes: .npz or .pkl of SMPL's layout [simrecon's own]",
    )
    parser.add_argument(
        "--mass-distribution",
        choices=tuple(mass.distributions()),
        help="of the body's mass; characters of Rempe et al. 2020 [standard]",
    )


def _add_settings(parser: argparse.ArgumentParser, plan_name: str | None = "default") -> None:
    """Options of every command that simulates."""
    plans = ", ".join(plan.names())
    default = "that of before" if plan_name is None else "%(default)s"
    parser.add_argument("--plan", default=plan_name, help=f"{plans}, or a path [{default}]")
    seed, threads = arguments.whole(LARGEST_SEED), arguments.whole(1024)
    parser.add_argument("--seed", type=seed, default=0, metavar="N", help="of random numbers [%(default)s]")
    parser.add_argument(
        "--threads", type=threads, default=0, metavar="N", help="0: one per core [%(default)s]"
    )


def _run(options: argparse.Namespace) -> int:
    results.check_writable(options.output)
    plan.read(options.plan)
    is_video = reading.is_video(options.input)
    if is_video and options.video is None:
        options.video = options.input
    given = reading.read(options)
    evidence.check_names(given, names.valid_names(), options.input)
    if is_video:
        options.input, given = _keep(options.output, given)
    if options.height_m is not None:
        given = replace(given, height_m=options.height_m)
    if options.mass_kg is not None:
        given = replace(given, mass_kg=options.mass_kg)
    things = scene.read(options.scene) if options.scene else Scene()
    return _make(options, given, things, wanted=_wanted(options))


def _keep(output: str, given: Evidence) -> tuple[str, Evidence]:
    """Write a video's evidence beside the result, to be looked at or run again, and go on from it."""
    path = Path(output).resolve()
    path = path.with_name(f"{path.name}.evidence.npz")
    path.parent.mkdir(parents=True, exist_ok=True)
    evidence.write(path, given)
    print(f"evidence written to {path}", file=sys.stderr)
    return str(path), replace(evidence.read(path), reading=given.reading)


def _wanted(options: argparse.Namespace) -> Wanted | None:
    if (options.betas, options.body_model, options.mass_distribution) == (None, None, None):
        return None
    return Wanted(*_shape(options), options.mass_distribution or "standard")


def _shape(options: argparse.Namespace) -> tuple[Array | None, ShapeSpace]:
    """Betas, if there are any, and whose they are."""
    shapes = shape.space() if options.body_model is None else model_file.read(options.body_model)
    betas = None if options.betas is None else shape.check(np.array(options.betas), shapes, "--betas")
    return betas, shapes


def _demo(options: argparse.Namespace) -> int:
    folder = resources.folder("example")
    options.input, options.video = folder / "beam.npz", folder / "beam.mp4"
    return _make(options, evidence.read(options.input), scene.read(folder / "beam.toml"))


def _make(
    options: argparse.Namespace,
    given: Evidence,
    things: Scene,
    start: Motion | None = None,
    wanted: Wanted | None = None,
    fit: KinematicFit | None = None,
) -> int:
    """Reconstruct and write; everything that may be wrong is checked before the work begins.

    Args:
        options: with output, plan, video, seed, threads and input.
        given: what one camera saw.
        things: the scene.
        start: a finished motion to begin from.
        wanted: the body's shape, as far as it is known.
        fit: the kinematic half, if it is known.
    """
    settings = plan.read(options.plan)
    results.check_writable(options.output)
    if options.video is not None:
        overlay.check_video(options.video, given.times_s, given.camera)
    found = None
    with _Stages() as stages:
        how: dict[str, Any] = {"seed": options.seed, "threads": options.threads, "report": stages}
        if wanted is not None:
            how["wanted"] = wanted
        if things.ground.calibrate:
            found = softfloor.calibrate(given, things, settings, **how)
            things, start = replace(things, ground=found.ground), found.motion
        made = pipeline.reconstruct(given, things, settings, start=start, fit=fit, **how)
    said = results.write(
        options.output,
        made,
        plan_name=str(options.plan),
        seed=options.seed,
        threads=options.threads,
        input_name=str(options.input),
        video=options.video,
        calibration=found,
    )
    print(_summary(said, str(options.output)))
    return EXIT_FALLBACK if said["frames"]["fallback"] else 0


def _spans(frames: list[int]) -> str:
    """Increasing numbers as `3-5, 9`."""
    runs = np.split(np.array(frames), np.flatnonzero(np.diff(frames) > 1) + 1)
    return ", ".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else str(run[0]) for run in runs)


def _summary(said: Report, folder: str) -> str:
    frames, totals, windows = said["frames"], said["totals"], said["windows"]
    simulated = f"{frames['simulated']} of {frames['count']} simulated"
    if frames["fallback"]:
        simulated += f", {frames['fallback']} on kinematic fallback"
    if frames["interpolated"]:
        simulated += f"; {frames['interpolated']} interpolated, the person was out of view"
    loss = f"{sum(w['loss'] for w in windows) / len(windows):.1f}, mean of the windows" if windows else "-"
    spent = f"{duration(totals['wall_s'])}, {duration(totals['seconds_per_second'])} per second of video"
    floor = said.get("soft_floor")
    files = ", ".join(sorted(path.name for path in Path(folder).iterdir()))
    rows = {"frames": simulated, "loss": loss, "time": spent}
    if exchanged := said["input"]["exchanged"]:
        mixed = (f"{limbs} in frames {_spans(frames)}" for limbs, frames in exchanged.items())
        rows["sides"] = f"left and right were mixed up, and exchanged: {', '.join(mixed)}"
    if floor:
        bound = ", an end of the search's range" if floor["at_bound"] else ""
        rows["floor"] = f"{floor['stiffness_Npm']:.3g} N/m{bound}, {floor['damping_Nspm']:.3g} N s/m"
    rows["written"] = f"{folder}: {files}"
    return "\n".join(f"{name:<9}{value}" for name, value in rows.items())


class _Stages:
    """Progress of `reconstruct`, one bar or line per stage; its `Report`."""

    def __init__(self) -> None:
        self._bar: Progress | None = None
        self._stage, self._total = "", 0.0

    def __enter__(self) -> _Stages:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self._finish()
        elif self._bar is not None and sys.stderr.isatty():
            print(file=sys.stderr)  # the error gets a line of its own

    def __call__(self, stage: str, done: float, total: float) -> None:
        if stage != self._stage:
            self._finish()
            self._stage, self._total = stage, total
            self._bar = Progress(total, stage).__enter__()
        if self._bar is not None and done < total:
            self._bar.update(done)

    def _finish(self) -> None:
        if self._bar is not None:
            self._bar.update(self._total)
            self._bar.__exit__(None, None, None)
