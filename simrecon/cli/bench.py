"""`simrecon bench`."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any

from simrecon.bench import page, runner, suite
from simrecon.cli import arguments
from simrecon.cli.commands import purpose
from simrecon.errors import InputError, printable
from simrecon.io import reading

EXIT_FAILED = 1


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    bench = arguments.command(commands, "bench", _bench, purpose("bench"))
    bench.add_argument("suite", metavar="SUITE", help=f"{', '.join(suite.names())}, or a path")
    bench.add_argument("--data", metavar="DIR", required=True, help="folder of the clips")
    bench.add_argument("-o", dest="output", metavar="OUT", required=True, help="folder of runs and tables")
    bench.add_argument(
        "--jobs", type=arguments.whole(256), default=1, metavar="N", help="runs at once [%(default)s]"
    )
    bench.add_argument(
        "--threads",
        type=arguments.whole(1024),
        default=0,
        metavar="N",
        help="threads of each run; 0: cores divided by jobs [%(default)s]",
    )
    bench.add_argument("--plan", metavar="NAME", help="another plan than the suite's")
    bench.add_argument("--clips", nargs="+", default=(), metavar="NAME", help="only these")
    bench.add_argument("--variants", nargs="+", default=(), metavar="NAME", help="only these")
    bench.add_argument(
        "--evaluator", metavar="FILE", help="independent script, run as FILE RESULT TRUTH EVIDENCE"
    )
    bench.add_argument("--write", metavar="FILE", help="Markdown whose part of this suite is replaced")


def _bench(options: argparse.Namespace) -> int:
    if options.jobs < 1:
        raise InputError(f"--jobs: found {options.jobs}; valid: 1 or more")
    chosen = suite.read(options.suite)
    if options.plan is not None:
        chosen = suite.with_plan(chosen, options.plan)
    report = Path(options.write) if options.write else None
    if report is not None and not report.parent.is_dir():
        raise InputError(f"--write: found no folder {report.parent}; valid: a file in an existing folder")
    before = "" if report is None else _before(report)
    content = runner.run(
        chosen,
        Path(options.data),
        Path(options.output),
        jobs=options.jobs,
        threads=options.threads,
        clips=tuple(options.clips),
        variants=tuple(options.variants),
        evaluator=Path(options.evaluator) if options.evaluator else None,
        report_row=_say,
    )
    text = page.markdown(chosen, content)
    if report is not None:
        runner.write(report, page.replaced(before, chosen.name, text))
        runner.copy_curves(chosen, content, Path(options.output), report.parent)
    print("\n".join(map(printable, text.split("\n"))), end="")  # a suite may hold any text
    return EXIT_FAILED if any(row["status"] == "failed" for row in content["runs"]) else 0


def _before(report: Path) -> str:
    """The page whose part is replaced, which may not be there yet.

    Raises:
        InputError: it can't be read.
    """
    if not os.path.lexists(report):
        return ""
    try:
        return reading.read_text(report)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"--write: {report}: cannot be read ({reason}); valid: a page in UTF-8") from error


def _say(done: int, count: int, row: dict[str, Any]) -> None:
    status = row["status"] if row["status"] != "failed" else f"failed: {row['message']}"
    print(
        f"{done}/{count}  {row['clip']}, {row['variant']}, seed {row['seed']}: {status}",
        file=sys.stderr,
        flush=True,
    )
