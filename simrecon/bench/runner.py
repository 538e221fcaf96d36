"""Runs all tasks of a suite, several at once, and writes its tables."""

from __future__ import annotations

import contextlib
import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from simrecon.bench import curves, material, page, processes, statics, targets
from simrecon.bench.execution import RESULT
from simrecon.bench.schema import Check, Suite
from simrecon.bench.task import BenchmarkTask, tasks
from simrecon.errors import InputError
from simrecon.exports import picture
from simrecon.io import atomic, full, provenance
from simrecon.io.messages import counted
from simrecon.system import processor

SCHEMA = "simrecon.bench/1"

Row = dict[str, Any]


def run(
    suite: Suite,
    data: Path,
    output: Path,
    *,
    jobs: int = 1,
    threads: int = 0,
    clips: tuple[str, ...] = (),
    variants: tuple[str, ...] = (),
    evaluator: Path | None = None,
    report_row: Callable[[int, int, Row], None] = lambda *_: None,
) -> Row:
    """Run a suite and write `<suite>.json` and `<suite>.md`; runs that are there already are kept.

    Args:
        suite: what to run.
        data: folder of the clips.
        output: folder of runs and tables, which is made.
        jobs: runs at once.
        threads: of the simulator in each; 0 shares the cores out among the jobs.
        clips: names of those to run, or none for all.
        variants: the same.
        evaluator: an independent script, see `task.BenchmarkTask`.
        report_row: called with the number of finished runs, of all, and the row of the one that finished.

    Returns:
        What is in the JSON.

    Raises:
        InputError: a folder or name that can't be used.
        DiskFullError: in one line, for all that could not be written; runs that are done are kept.
    """
    for kind, listed, there in (
        ("clip", clips, [clip.name for clip in suite.clip]),
        ("variant", variants, [variant.name for variant in suite.variant]),
    ):
        if unknown := [name for name in listed if name not in there]:
            raise InputError(f"{kind}: found {', '.join(unknown)}; valid: {', '.join(there)}")
    if not data.is_dir():
        raise InputError(f"{data}: found no such folder; valid: the folder of the clips")
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{output}: cannot be made ({error.strerror}); give a folder in a writable place"
        ) from error
    threads = threads or max(1, processor.cores() // jobs)
    work = [
        dataclasses.replace(task, threads=threads)
        for task in tasks(suite, data.resolve(), output, evaluator)
        if (not clips or task.clip.name in clips) and (not variants or task.variant.name in variants)
    ]
    with full.told(output):
        rows = _rows(work, jobs, output, report_row)
        content = _content(suite, jobs, rows)
        done = [work[i] for i in sorted(rows) if rows[i]["status"] != "failed"]
        _save(suite, content, output)  # before the pictures, which can fail
        content["pictures"] = _pictures(suite, done, output)
        content["curves"] = _curves(suite, done, output)
        _save(suite, content, output)
    return content


def _rows(
    work: list[BenchmarkTask], jobs: int, output: Path, report_row: Callable[[int, int, Row], None]
) -> dict[int, Row]:
    """Do the tasks: rows by the index of theirs."""
    rows: dict[int, Row] = {}
    try:
        with contextlib.closing(processes.finished(work, jobs)) as finished:
            for index, row in finished:
                rows[index] = row
                report_row(len(rows), len(work), row)
    except KeyboardInterrupt as error:
        done = sum(row["status"] != "failed" for row in rows.values())
        raise KeyboardInterrupt(f"{done} of {counted(len(work), 'run')} kept in {output}") from error
    return rows


def _content(suite: Suite, jobs: int, rows: dict[int, Row]) -> Row:
    """What is in the JSON, without pictures yet."""
    content: Row = {
        "schema": SCHEMA,
        "suite": suite.name,
        "purpose": suite.purpose,
        "plan": suite.plan,
        "seeds": list(suite.seeds),
        "versions": provenance.versions(),
        "machine": provenance.machine(),
        "jobs": jobs,
        "runs": [rows[index] for index in sorted(rows)],
    }
    content["checks"] = [checked(check) for check in suite.check]
    content["targets"] = targets.verdicts(suite, content["runs"])
    content["pictures"], content["curves"] = [], []
    return content


def _save(suite: Suite, content: Row, output: Path) -> None:
    write(output / f"{suite.name}.json", json.dumps(content, indent=1) + "\n")
    write(output / f"{suite.name}.md", page.markdown(suite, content))


def _pictures(suite: Suite, done: list[BenchmarkTask], output: Path) -> list[str]:
    """Draw the suite's pictures of the first variant and seed; names of the files, in `pictures`."""
    first = {task.clip.name: task.folder / RESULT for task in _first(suite, done)}
    entries = [entry for entry in suite.picture if entry.clip in first]
    if entries:
        (output / "pictures").mkdir(exist_ok=True)
    for entry in entries:
        picture.write(first[entry.clip], output / "pictures" / f"{entry.clip}.png", entry.at)
    return [f"{entry.clip}.png" for entry in entries]


def _curves(suite: Suite, done: list[BenchmarkTask], output: Path) -> list[str]:
    """Draw forces over time of the first variant and seed; names of the files, in a folder of that name.

    Without matplotlib nothing is drawn, and the page says so.
    """
    if not suite.curves or not curves.drawable():
        return []
    folder = output / suite.name
    folder.mkdir(exist_ok=True)
    drawn = [
        curves.write(task.folder / RESULT, material.files(task)[1], folder / f"{task.clip.name}.png")
        for task in _first(suite, done)
    ]
    return [path.name for path in drawn if path is not None]


def copy_curves(suite: Suite, content: Row, output: Path, folder: Path) -> None:
    """Put the curves of a run beside a page that shows them, in a folder of the suite's name.

    Raises:
        InputError: they can't be written.
    """
    for name in content["curves"]:
        target = folder / suite.name / name
        with atomic.reported(target):
            target.parent.mkdir(exist_ok=True)
            atomic.write_bytes(target, (output / suite.name / name).read_bytes())


def _first(suite: Suite, done: list[BenchmarkTask]) -> list[BenchmarkTask]:
    """Runs of the first variant and seed."""
    return [task for task in done if task.variant == suite.variant[0] and task.seed == suite.seeds[0]]


def checked(check: Check) -> Row:
    """A check's `name`, `measured`, `expected`, `unit`, `error_pct`, `within_pct` and `met`."""
    result = statics.CHECKS[check.formula](**check.settings)
    error = 100.0 * (result.measured / result.expected - 1.0)
    return {
        "name": check.name,
        **dataclasses.asdict(result),
        "error_pct": error,
        "within_pct": check.within_pct,
        "met": bool(abs(error) <= check.within_pct),
    }


def write(target: Path, content: str) -> None:
    """Write a file; the one that was there is replaced at once.

    Raises:
        InputError: it can't be written.
    """
    with atomic.reported(target):
        atomic.write_text(target, content)
