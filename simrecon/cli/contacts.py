"""`simrecon contacts`: what touched in a result, as a file to edit and to run again with."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from simrecon.cli import arguments
from simrecon.cli.commands import purpose
from simrecon.contact import wishes
from simrecon.errors import InputError, printable
from simrecon.io import atomic
from simrecon.io.messages import counted
from simrecon.results import contacts, open_result


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    parser = arguments.command(commands, "contacts", _help, purpose("contacts"))
    actions = parser.add_subparsers(required=True, metavar="ACTION")
    show = arguments.command(actions, "show", _show, "what touched when, with what was wished of it")
    show.add_argument("result", metavar="OUT", help="result folder")
    show.add_argument("-o", dest="output", metavar="FILE", help="contacts.toml to write [standard output]")


def _help(_: argparse.Namespace) -> int:
    raise InputError("contacts needs an action; valid: show")


def _show(options: argparse.Namespace) -> int:
    result = open_result(options.result)
    found = contacts.spans(result.body, result.scene, result.motion)
    text = wishes.dumps(result.job.contacts, found)
    if options.output is None:
        sys.stdout.write(text)
        return 0
    with atomic.reported(options.output):
        atomic.write_bytes(Path(options.output), text.encode())
    for part, spans in found.items():
        if spans:
            seconds = sum(high - low for low, high in spans)
            print(f"{part:<14} touches {counted(len(spans), 'time')}, {seconds:.2f} s in all")
    print(f"written        {printable(options.output)}")
    return 0
