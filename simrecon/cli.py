"""The command line: arguments, progress and messages; all else happens in the modules below."""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import sys
import traceback
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import mujoco

import simrecon
from simrecon import evidence, plan, reconstruct, resources, results, scene
from simrecon.body import names
from simrecon.errors import InputError, SimreconError
from simrecon.evidence.npz import HEIGHT_RANGE_M, MASS_RANGE_KG
from simrecon.progress import Progress, duration
from simrecon.results import overlay, scores
from simrecon.types import Evidence, Report, Scene

EXIT_FAILED, EXIT_FALLBACK, EXIT_INTERRUPTED = 1, 3, 130
ENGINES = ("sampling",)
LARGEST_SEED = 2**63 - 1


def main(argv: list[str] | None = None) -> int:
    """Run a command.

    Args:
        argv: arguments without the program's name; those of the process if None.

    Returns:
        Exit status: 0 all simulated, 1 failed, 2 bad usage or input, 3 finished with frames on kinematic
        fallback, 130 interrupted.
    """
    given = sys.argv[1:] if argv is None else argv
    try:
        with _quiet_simulator():
            options = _parser().parse_args(given)
            finished: int = options.command(options)
            return finished
    except SystemExit as done:  # argparse, after -h and --version
        return int(done.code or 0)
    except KeyboardInterrupt:
        print("simrecon: interrupted, nothing was written", file=sys.stderr)
        return EXIT_INTERRUPTED
    except Exception as error:
        debug = "--debug" in given
        if debug:
            traceback.print_exc()
        message, status = str(error), EXIT_FAILED
        if isinstance(error, SimreconError):
            status = error.exit_status
        else:  # a defect
            message = f"{type(error).__name__}: {message}{'' if debug else '; --debug shows where'}"
        print("simrecon: error:", " ".join(message.split()), file=sys.stderr)
        return status


def _run(options: argparse.Namespace) -> int:
    given = evidence.read(options.input)
    evidence.check_names(given, names.valid_names(), options.input)
    if options.height_m is not None:
        given = replace(given, height_m=options.height_m)
    if options.mass_kg is not None:
        given = replace(given, mass_kg=options.mass_kg)
    return _make(options, given, scene.read(options.scene) if options.scene else Scene())


def _demo(options: argparse.Namespace) -> int:
    folder = resources.folder("example")
    options.input, options.video = folder / "beam.npz", folder / "beam.mp4"
    return _make(options, evidence.read(options.input), scene.read(folder / "beam.toml"))


def _make(options: argparse.Namespace, given: Evidence, things: Scene) -> int:
    """Everything that may be wrong is checked before the work begins."""
    settings = plan.read(options.plan)
    results.check_writable(options.output)
    if options.video is not None:
        overlay.check_video(options.video, given.times_s, given.camera)
    with _Stages() as stages:
        made = reconstruct.reconstruct(
            given, things, settings, seed=options.seed, threads=options.threads, report=stages
        )
    said = results.write(
        options.output,
        made,
        plan_name=str(options.plan),
        seed=options.seed,
        threads=options.threads,
        input_name=str(options.input),
        video=options.video,
    )
    print(_summary(said, str(options.output)))
    return EXIT_FALLBACK if said["frames"]["fallback"] else 0


def _eval(options: argparse.Namespace) -> int:
    found = scores.score(options.result, options.truth, options.evidence)
    print(json.dumps(found, indent=1) if options.json else scores.text(found))
    return 0


def _summary(said: Report, folder: str) -> str:
    frames, totals, windows = said["frames"], said["totals"], said["windows"]
    simulated = f"{frames['simulated']} of {frames['count']} simulated"
    if frames["fallback"]:
        simulated += f", {frames['fallback']} on kinematic fallback"
    if frames["interpolated"]:
        simulated += f"; {frames['interpolated']} interpolated, the person was out of view"
    loss = f"{sum(w['loss'] for w in windows) / len(windows):.1f}, mean of the windows" if windows else "-"
    spent = f"{duration(totals['wall_s'])}, {duration(totals['seconds_per_second'])} per second of video"
    files = ", ".join(sorted(path.name for path in Path(folder).iterdir()))
    rows = {"frames": simulated, "loss": loss, "time": spent, "written": f"{folder}: {files}"}
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


@contextlib.contextmanager
def _quiet_simulator() -> Iterator[None]:
    """Rollouts that diverge are expected, and counted; MuJoCo would print each, and log it in a file here."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are ours: one line."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message}; `{self.prog} -h` shows what is valid")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="simrecon", description=simrecon.__doc__, allow_abbrev=False)
    parser.add_argument("--version", action="version", version=f"simrecon {simrecon.__version__}")
    parser.add_argument("--debug", action="store_true", help="show the traceback of an error")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    demo = _command(commands, "demo", _demo, "the main job on the example that ships with simrecon")
    demo.add_argument(
        "-o", dest="output", metavar="OUT", default="out/demo", help="result folder [%(default)s]"
    )
    _add_settings(demo)

    run = _command(commands, "run", _run, "from evidence to a simulated motion")
    run.add_argument("input", metavar="INPUT", help="evidence (.npz, see docs/formats.md)")
    run.add_argument("-o", dest="output", metavar="OUT", required=True, help="result folder, which is made")
    _add_settings(run)
    run.add_argument("--engine", choices=ENGINES, default=ENGINES[0], help="optimiser [%(default)s]")
    run.add_argument("--scene", metavar="FILE", help="floor and things (scene.toml) [a floor at z = 0]")
    run.add_argument("--video", metavar="FILE", help="what the overlay is drawn on [plain ground]")
    run.add_argument("--height-m", type=_number(HEIGHT_RANGE_M), metavar="M", help="the person's height")
    run.add_argument("--mass-kg", type=_number(MASS_RANGE_KG), metavar="KG", help="the person's mass")

    score = _command(commands, "eval", _eval, "score a result against a reference")
    score.add_argument("result", metavar="OUT", help="result folder")
    score.add_argument("truth", metavar="TRUTH", help="reference (.npz, see docs/formats.md)")
    score.add_argument("evidence", metavar="EVIDENCE", nargs="?", help="what it was made from, scored too")
    score.add_argument("--json", action="store_true", help="print JSON")
    return parser


def _command(
    commands: Any, name: str, function: Callable[[argparse.Namespace], int], purpose: str
) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = commands.add_parser(
        name, help=purpose, description=purpose[0].upper() + purpose[1:] + ".", allow_abbrev=False
    )
    parser.set_defaults(command=function)
    parser.add_argument(
        "--debug", action="store_true", default=argparse.SUPPRESS, help="show the traceback of an error"
    )
    return parser


def _add_settings(parser: argparse.ArgumentParser) -> None:
    plans = ", ".join(plan.names())
    parser.add_argument("--plan", default="default", help=f"{plans}, or a path [%(default)s]")
    seed, threads = _whole(LARGEST_SEED), _whole(1024)
    parser.add_argument("--seed", type=seed, default=0, metavar="N", help="of random numbers [%(default)s]")
    parser.add_argument(
        "--threads", type=threads, default=0, metavar="N", help="0: one per core [%(default)s]"
    )


def _whole(high: int) -> Callable[[str], int]:
    def parse(text: str) -> int:
        if not (text.isdecimal() and text.isascii() and len(text) < 20 and int(text) <= high):
            raise argparse.ArgumentTypeError(f"found {text!r}; valid: a whole number from 0 to {high}")
        return int(text)

    return parse


def _number(bounds: tuple[float, float]) -> Callable[[str], float]:
    low, high = bounds

    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"found {text!r}; valid: a number from {low:g} to {high:g}")
        return value

    return parse
