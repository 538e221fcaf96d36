"""`simrecon report`: the page of a result, made anew."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from simrecon import results, viewer
from simrecon.cli import arguments
from simrecon.cli.commands import purpose
from simrecon.errors import printable
from simrecon.results import folder


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    parser = arguments.command(commands, "report", _report, purpose("report"))
    parser.add_argument("result", metavar="OUT", help="result folder")


def _report(options: argparse.Namespace) -> int:
    for one in folder.people(Path(options.result)) or (options.result,):
        path = viewer.write(results.open_result(one))
        print(f"written  {printable(str(path))}")
    return 0
