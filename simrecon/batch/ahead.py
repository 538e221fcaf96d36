"""What there is to do, found out by the workers: what is done, what can't be read, and what it will cost."""

from __future__ import annotations

import contextlib
import shutil
import tempfile
import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from simrecon.batch import cluster, failures, forecast, records
from simrecon.batch.clips import Clip
from simrecon.batch.cluster import Crew
from simrecon.batch.forecast import Cost
from simrecon.batch.journal import Places
from simrecon.batch.records import Record
from simrecon.errors import InputError
from simrecon.results import whole
from simrecon.results.folder import REPORT
from simrecon.system import processor, signals

Say = Callable[[str], None]


@dataclass(frozen=True)
class Settings:
    """Of a batch.

    Attributes:
        output: its folder.
        jobs: clips at once, 0: one per core, or on a running cluster as many as it takes.
        scheduler: of a cluster that runs, or None.
        retry: further attempts at a clip that fails, other than by bad input.
        force: redo what is done.
        verify: redo what is done and is no longer what was written, by its hashes; else by its sizes.
        until_s: when to end, s since 1970, or None.
        memory_bytes: that each local worker may use, 0 for no limit.
    """

    output: Path
    jobs: int = 0
    scheduler: str | None = None
    retry: int = 1
    force: bool = False
    verify: bool = False
    until_s: float | None = None
    memory_bytes: int = 0


def plan_ahead(clips: Sequence[Clip], settings: Settings, say: Say = lambda _: None) -> dict[str, Any]:
    """What a batch would do and cost, measured now on a short piece of one clip of each plan.

    Returns:
        `clips`, `kept`, `failed` (messages by name), `video_s` to do, `seconds` by plan and second of video,
        `wall_s`, `size_bytes` and `free_bytes`.
    """
    places = Places(settings.output.resolve())
    refuse_result(settings.output)
    with signals.interruptible(), crew(settings, len(clips), uuid.uuid4().hex[:12]) as workers:
        facts = survey(workers, clips)
        failed = {name: row["message"] for name, row in facts.items() if "key" not in row}
        kept = (
            []
            if settings.force
            else [name for name, row in facts.items() if is_done(places, row, hashes=settings.verify)]
        )
        rows = [row for name, row in facts.items() if name not in failed and name not in kept]
        by_name = {clip.name: clip for clip in clips}
        count, cores = at_once(settings, len(clips)), processor.cores()
        groups: dict[str, tuple[Cost, list[dict[str, Any]]]] = {}
        for row in rows:
            if row["plan_key"] not in groups:
                shown = by_name[row["name"]]
                say(f"measuring plan {Path(shown.plan).stem} on a piece of {shown.name}")
                try:
                    cost = _measured(workers, shown, min(count, cores))
                except Exception as error:  # of this clip, whatever it is; the next one may be measured
                    failed[shown.name] = failures.failure(shown.name, error)["message"]
                    continue
                groups[row["plan_key"]] = (cost, [])
            groups[row["plan_key"]][1].append(row)
        rows = [row for row in rows if row["name"] not in failed]
    seconds, wall_s, size = forecast.total(groups, count, cores)
    rates = {}
    for _, inside in groups.values():
        video = sum(row["video_s"] for row in inside)
        rates[by_name[inside[0]["name"]].plan] = sum(seconds[row["name"]] for row in inside) / video
    return {
        "clips": len(clips),
        "kept": kept,
        "failed": failed,
        "video_s": sum(row["video_s"] for row in rows),
        "seconds": rates,
        "wall_s": wall_s,
        "size_bytes": size,
        "free_bytes": shutil.disk_usage(_existing(places.root)).free,
        "jobs": min(count, max(len(rows), 1)),
    }


def refuse_result(folder: Path) -> None:
    """Refuse the folder of a single result as that of a batch.

    Raises:
        InputError: it is one.
    """
    if (folder / REPORT).is_file() and not Places(folder).events.is_file():
        raise InputError(
            f"{folder}: found the result of a single run; valid: a new folder, or that of a batch"
        )


def survey(crew: Crew, clips: Sequence[Clip]) -> dict[str, dict[str, Any]]:
    """What there is to do, by name, in the order of the clips; what a worker died of is read once more."""
    futures = {crew.survey(clip): clip for clip in clips}
    answers: dict[str, dict[str, Any]] = {}
    again = set[str]()
    while len(answers) < len(clips):
        kind, item = crew.inbox.get()
        if kind != "done" or item not in futures:
            continue
        name = futures[item].name
        if cluster.died(item) and name not in again:  # it may not have been this input that killed it
            again.add(name)
            futures[crew.survey(futures[item])] = futures[item]
        elif cluster.died(item):
            message = "the worker process died while it read this input"
            answers[name] = {"name": name, "kind": "error", "message": message, "trace": ""}
        else:
            answers[name] = cluster.value(item)
    return {clip.name: answers[clip.name] for clip in clips}


def _measured(crew: Crew, clip: Clip, jobs: int) -> Cost:
    """Cost of a clip's plan with as many measurements at once as clips will run."""
    with tempfile.TemporaryDirectory(prefix="simrecon-") as scratch:
        futures = {crew.measure(clip, f"{scratch}/{i}") for i in range(jobs)}
        rows: list[dict[str, float]] = []
        while len(rows) < jobs:
            kind, item = crew.inbox.get()
            if kind == "done" and item in futures:
                rows.append(cluster.value(item))
    return forecast.cost(rows)


def crew(settings: Settings, clips: int, run_id: str) -> contextlib.AbstractContextManager[Crew]:
    """The workers of a batch."""
    return cluster.crew(run_id, at_once(settings, clips), settings.scheduler, settings.memory_bytes)


def at_once(settings: Settings, clips: int) -> int:
    """Clips at once."""
    if settings.jobs:
        return min(settings.jobs, max(clips, 1))
    if settings.scheduler is not None:
        return max(clips, 1)  # all, so that a cluster that adapts itself sees how much there is to do
    return min(processor.cores(), max(clips, 1))


def is_done(places: Places, facts: dict[str, Any], *, hashes: bool = False) -> Record | None:
    """The record of a clip of which there is a whole result of the same key.

    Args:
        places: of the batch.
        facts: of the clip (`survey.survey`).
        hashes: compare the hashes of its files too, not only their sizes.
    """
    found = records.read(places, facts["name"])
    if found is None or found.key != facts.get("key"):
        return None
    return None if whole.damage(places.result(facts["name"]), found.files, hashes=hashes) else found


def _existing(path: Path) -> Path:
    while not path.exists():
        path = path.parent
    return path
