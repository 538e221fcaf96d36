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
from simrecon.io.messages import counted
from simrecon.replay import SIMULATED


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
    parser.add_argument("-o", dest="output", metavar="DIR", help="folder for the files [OUT]")


def _export(options: argparse.Namespace) -> int:
    result = results.open_result(options.result)
    for path in exports.export(result, options.to.split(","), options.output):
        print(f"written  {path}")
    fallback = int(np.count_nonzero(result.motion.status != SIMULATED))
    if fallback:
        verb = "is" if fallback == 1 else "are"
        print(f"{counted(fallback, 'frame')} {verb} not simulated, but the kinematic fit", file=sys.stderr)
    return EXIT_FALLBACK if fallback else 0
