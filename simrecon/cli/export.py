"""`simrecon export`: a result as files of other programs."""

from __future__ import annotations

import argparse
import sys
from typing import Any

import numpy as np

from simrecon import exports, results
from simrecon.cli import arguments
from simrecon.cli.commands import purpose
from simrecon.cli.run import EXIT_FALLBACK
from simrecon.errors import printable
from simrecon.exports import view as views
from simrecon.exports.view import RIGS
from simrecon.io.messages import counted
from simrecon.metrics.filters import possible_hz


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    parser = arguments.command(commands, "export", _export, purpose("export"))
    parser.add_argument("result", metavar="OUT", help="result folder")
    parser.add_argument(
        "--to",
        metavar="FORMAT,…",
        required=True,
        help=f"formats, between commas: {', '.join(exports.FORMATS)}",
    )
    parser.add_argument("-o", dest="output", metavar="DIR", help="folder for the files [OUT/export]")
    parser.add_argument("--rig", default="simrecon", help=f"joint names: {', '.join(RIGS)} [%(default)s]")
    parser.add_argument("--fps", type=float, metavar="HZ", help="frame rate [that of the result]")
    parser.add_argument(
        "--of", default="simulation", help="simulation, or fit: the kinematic fit [%(default)s]"
    )
    parser.add_argument(
        "--legs",
        type=float,
        default=1.0,
        metavar="RATIO",
        help="for a rig with legs so many times as long; feet stay where they stand [1]",
    )
    parser.add_argument(
        "--cutoff",
        type=float,
        metavar="HZ",
        help="low-pass motion and forces alike, without lag [not at all]",
    )
    parser.add_argument(
        "--body-model",
        metavar="FILE",
        help="where the body model of the person's shape is, for amass and smplx [where it was]",
    )


def _export(options: argparse.Namespace) -> int:
    result = results.open_result(options.result)
    formats = [word.strip() for word in options.to.split(",")]
    asked = {"rig": options.rig, "fps": options.fps, "of": options.of, "legs": options.legs}
    asked |= {"cutoff_hz": options.cutoff, "body_model": options.body_model}
    for path in exports.export(result, formats, options.output, **asked):
        print(f"written  {printable(str(path))}")
    if options.cutoff is not None:
        rate_hz = 1.0 / views.interval_s(result, options.fps)
        used_hz = possible_hz(options.cutoff, 1.0 / rate_hz)
        if used_hz < options.cutoff:
            allowed = f"{rate_hz:.3g} frames a second allow no more"
            print(f"low-passed at {used_hz:.3g} Hz: {allowed}", file=sys.stderr)
    if options.of != "simulation":
        return 0
    if result.motion.is_planned:
        print("nothing is simulated: the motion is the plan", file=sys.stderr)
    fallback = int(np.count_nonzero(~result.motion.kept))
    if fallback:
        verb = "is" if fallback == 1 else "are"
        print(f"{counted(fallback, 'frame')} {verb} not simulated, but the kinematic fit", file=sys.stderr)
    return EXIT_FALLBACK if fallback else 0
