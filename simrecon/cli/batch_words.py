"""`simrecon batch status`, `report` and `verify`: what is asked of the folder of a batch."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from simrecon.batch import page, records, status
from simrecon.batch.journal import Places, cannot_write
from simrecon.cli import arguments
from simrecon.errors import printable
from simrecon.io.messages import counted

EXIT_FAILED = 1


def add(batch: arguments.Parser) -> None:
    """Add the words to the command."""
    state = batch.word("status", _status, "show how a batch stands")
    state.add_argument("--json", action="store_true", help="print JSON")
    report = batch.word("report", _report, "write index.html of a batch again")
    verify = batch.word("verify", _verify, "compare the results of a batch with what was written")
    for parser in (state, report, verify):
        parser.add_argument("folder", metavar="OUT", help="folder of a batch")


def _status(parsed: argparse.Namespace) -> int:
    state = status.read(Places(Path(parsed.folder)))
    print(json.dumps(status.table(state), indent=1) if parsed.json else status.text(state, parsed.folder))
    return 0


def _verify(parsed: argparse.Namespace) -> int:
    found = records.verify(Places(Path(parsed.folder)))
    damaged = {name: words for name, words in found.items() if words}
    for name, words in damaged.items():
        print(f"damaged   {printable(name)}: {printable(words)}")
    advice = "; the same `simrecon batch` with --verify makes them anew" if damaged else ""
    print(f"{len(found) - len(damaged)} of {counted(len(found), 'result')} as written{advice}")
    return EXIT_FAILED if damaged else 0


def _report(parsed: argparse.Namespace) -> int:
    places = Places(Path(parsed.folder))
    try:
        print(printable(str(page.write(places))))
    except OSError as error:
        raise cannot_write(places.page, error) from error
    return 0
