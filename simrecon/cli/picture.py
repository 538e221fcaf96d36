"""`simrecon picture`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from simrecon.body import clothed
from simrecon.cli import arguments
from simrecon.cli.commands import purpose
from simrecon.errors import printable
from simrecon.exports import picture
from simrecon.results import open_result


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    draw = arguments.command(commands, "picture", _picture, purpose("picture"))
    draw.add_argument("result", metavar="OUT", help="result folder")
    draw.add_argument(
        "--at",
        nargs="+",
        default=list(picture.WORDS),
        metavar="WHEN",
        help=f"seconds, {', '.join(picture.WORDS)} [all of these]",
    )
    words = "how the person is drawn: skin or primitives [skin]"
    draw.add_argument("--style", choices=clothed.STYLES, default="skin", help=words)
    draw.add_argument("-o", dest="output", metavar="PNG", help="picture [the result's name, .png, beside it]")


def _picture(options: argparse.Namespace) -> int:
    folder = open_result(options.result).folder.resolve()
    target = Path(options.output or folder.with_name(f"{folder.name}.png"))
    pairs = zip(picture.write(options.result, target, options.at, options.style), options.at, strict=True)
    shown = (f"{frame} ({word if word in picture.WORDS else f'at {word} s'})" for frame, word in pairs)
    print(f"frames    {', '.join(shown)}; the first one of the clip is 0")
    print(f"written   {printable(str(target))}")
    return 0
