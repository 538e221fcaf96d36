"""`simrecon eval`."""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any

from simrecon import results
from simrecon.cli import arguments, observing
from simrecon.cli.commands import purpose
from simrecon.errors import InputError, printable
from simrecon.evaluation import scores, table
from simrecon.evidence import Span
from simrecon.io import atomic
from simrecon.job.options import TIME_RANGE_S


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    score = arguments.command(commands, "eval", _eval, purpose("eval"))
    score.add_argument("result", metavar="OUT", help="result folder")
    score.add_argument("truth", metavar="TRUTH", help="reference (.npz, see docs/formats.md)")
    score.add_argument(
        "evidence", metavar="EVIDENCE", nargs="?", help="what the result was made from, to be scored as well"
    )
    score.add_argument("--input", metavar="EVIDENCE", help="EVIDENCE, given as an option")
    score.add_argument("--json", action="store_true", help="print JSON")
    score.add_argument("-o", dest="output", metavar="FILE", help="write JSON to a file as well")
    score.add_argument(
        "--seed",
        type=arguments.whole(2**63 - 1),
        default=0,
        metavar="N",
        help="seed of the confidence intervals [%(default)s]",
    )
    for flag, word in (("--from", "before"), ("--to", "after")):
        read = arguments.number(TIME_RANGE_S)
        score.add_argument(
            flag, dest=f"{flag[2:]}_", type=read, metavar="S", help=f"score nothing {word} this time"
        )
    observing.add(score, observing.READING, without=("from_s", "to_s", "every"))


def _eval(options: argparse.Namespace) -> int:
    if options.evidence is not None and options.input is not None:
        raise InputError(
            f"found both EVIDENCE ({options.evidence}) and --input ({options.input}); valid: one"
        )
    seen = options.input if options.evidence is None else options.evidence
    asked = observing.job(options, seen)
    estimate = observing.observe(asked) if asked.input else None
    span = Span(options.from_, options.to_)
    scored = scores.score(options.result, options.truth, estimate, seed=options.seed, span=span)
    content = json.dumps(scored.as_dict(), indent=1)
    if options.output is not None:
        with atomic.reported(options.output):
            atomic.write_text(options.output, content + "\n")
    if results.read_motion(options.result).is_planned:
        print("result is a plan: nothing was simulated", file=sys.stderr)
    lines = [content] if options.json else map(printable, table.text(scored).split("\n"))
    print("\n".join(lines))  # a reference may name anything
    return 0
