"""`simrecon eval`."""

from __future__ import annotations

import argparse
import json
from typing import Any

from simrecon.cli import arguments
from simrecon.results import scores


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    score = arguments.command(commands, "eval", _eval, "score a result against a reference")
    score.add_argument("result", metavar="OUT", help="result folder")
    score.add_argument("truth", metavar="TRUTH", help="reference (.npz, see docs/formats.md)")
    score.add_argument("evidence", metavar="EVIDENCE", nargs="?", help="what it was made from, scored too")
    score.add_argument("--json", action="store_true", help="print JSON")


def _eval(options: argparse.Namespace) -> int:
    found = scores.score(options.result, options.truth, options.evidence)
    print(json.dumps(found, indent=1) if options.json else scores.text(found))
    return 0
