"""`simrecon batch`."""

from __future__ import annotations

import argparse
import json
import re
import sys
import time
from pathlib import Path
from typing import Any

from simrecon import plan, scene
from simrecon.batch import ahead, clips, manifest, runner
from simrecon.batch.ahead import Settings
from simrecon.batch.ledger import Outcome
from simrecon.cli import arguments, batch_words, options
from simrecon.cli.commands import purpose
from simrecon.cli.run import EXIT_FALLBACK
from simrecon.contact import wishes
from simrecon.errors import InputError, printable
from simrecon.system import processor
from simrecon.system.memory import total_bytes
from simrecon.system.progress import Progress, duration

EXIT_INTERRUPTED = 130
GIB = 2**30


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    batch = arguments.command(commands, "batch", _batch, purpose("batch"))
    batch.epilog = (
        "simrecon batch status OUT shows how it stands, simrecon batch report OUT writes index.html."
    )
    batch_words.add(batch)
    add_one = batch.add_argument
    add_one("inputs", metavar="INPUT", nargs="+", help="files, folders, globs, manifests (.toml, .csv)")
    add_one("-o", dest="output", metavar="OUT", help="folder for the results")
    add_one(
        "--jobs",
        type=arguments.whole(4096),
        default=0,
        metavar="N",
        help="clips at once; 0: one per core [%(default)s]",
    )
    add_one("--scheduler", metavar="ADDRESS", help="address of a running dask cluster, or its scheduler file")
    add_one("--scene-dir", metavar="DIR", help="folder in which NAME.toml is the scene of the clip NAME")
    add_one(
        "--video-dir",
        metavar="DIR",
        help="folder in which NAME.mp4 is the video to draw the overlay of NAME on",
    )
    add_one(
        "--retry",
        type=arguments.whole(100),
        default=1,
        metavar="N",
        help="further attempts at a clip that fails [%(default)s]",
    )
    add_one("--until", metavar="HH:MM", help="stop at this time; the same command continues later")
    add_one(
        "--memory-gib",
        type=arguments.number((0.25, 65536.0)),
        metavar="N",
        help="memory of each worker [its share of this machine's]",
    )
    add_one("--force", action="store_true", help="redo clips that are finished")
    add_one("--verify", action="store_true", help="redo finished clips whose files are not what was written")
    add_one("--dry-run", action="store_true", help="only print what there is to do, and what it will cost")
    add_one("--json", action="store_true", help="with --dry-run: print JSON")
    options.add(batch)


def _batch(parsed: argparse.Namespace) -> int:
    if parsed.output is None:
        raise InputError(
            "-o OUT is needed: the folder of the results; `simrecon batch -h` shows what is valid"
        )
    chosen = clips.collect(
        parsed.inputs,
        _defaults(parsed),
        scene_folder=parsed.scene_dir,
        video_folder=parsed.video_dir,
    )
    settings = _settings(parsed, len(chosen))
    if parsed.dry_run:
        return _dry_run(parsed, chosen, settings)
    shown = _Shown()
    outcome = runner.run(chosen, settings, shown.say, shown.progress)
    shown.end()
    return _end(outcome, parsed.output)


def _defaults(parsed: argparse.Namespace) -> dict[str, Any]:
    """What was said of all clips; files that are named are there, and plans and scenes can be read."""
    values = options.given(parsed)
    for name in ("planner", "engine"):
        if getattr(parsed, name) is not None:
            values[name] = getattr(parsed, name)
    if parsed.plan is not None:
        plan.read(parsed.plan)
        values["plan"] = parsed.plan if parsed.plan in plan.names() else str(Path(parsed.plan).resolve())
    if parsed.scene is not None:
        scene.read(parsed.scene)
        values["scene"] = str(Path(parsed.scene).resolve())
    if parsed.contacts is not None:
        wishes.read(parsed.contacts)
        values["contacts"] = str(Path(parsed.contacts).resolve())
    for name, option in manifest.OPTIONS.items():
        if option.rules.get("file") and name in values:
            values[name] = str(Path(values[name]).resolve())
    return values


def _settings(parsed: argparse.Namespace, count: int) -> Settings:
    memory = int(parsed.memory_gib * GIB) if parsed.memory_gib else 0
    if not memory and parsed.scheduler is None:
        jobs = parsed.jobs or min(processor.cores(), count)
        memory = total_bytes() // max(jobs, 1)
    return Settings(
        output=Path(parsed.output),
        jobs=parsed.jobs,
        scheduler=parsed.scheduler,
        retry=parsed.retry,
        force=parsed.force,
        verify=parsed.verify,
        until_s=None if parsed.until is None else until(parsed.until, time.time()),
        memory_bytes=memory,
    )


def until(text: str, now_s: float) -> float:
    """The next time, s since 1970, at which a clock here shows HH:MM.

    Raises:
        InputError: it is no such time.
    """
    match = re.fullmatch(r"([01]?\d|2[0-3]):([0-5]\d)", text)
    if match is None:
        raise InputError(f"--until: found {text!r}; valid: a time such as 07:00")
    now = time.localtime(now_s)
    fields = (now.tm_year, now.tm_mon, now.tm_mday, int(match[1]), int(match[2]), 0, 0, 0, -1)
    then = time.mktime(fields)
    if then <= now_s:
        then = time.mktime((*fields[:2], fields[2] + 1, *fields[3:]))
    return then


def _end(outcome: Outcome, output: str) -> int:
    """Say how it ended; what was not done is listed."""
    counts = {
        "done": outcome.done,
        "done before": outcome.kept,
        "failed": outcome.failed,
        "left": outcome.left,
    }
    print(", ".join(f"{len(names)} {word}" for word, names in counts.items() if names) or "nothing to do")
    for name in outcome.fallback:
        print(f"fallback  {printable(name)}")
    for name, message in outcome.failed.items():
        print(f"failed    {printable(name)}: {printable(message)}")
    if outcome.left:
        names = printable(", ".join(outcome.left))
        print(f"left      {names}; the same command goes on ({printable(outcome.reason)})")
    print(f"report    {printable(str(Path(output) / 'index.html'))}")
    if outcome.reason == "interrupted":
        return EXIT_INTERRUPTED
    return EXIT_FALLBACK if outcome.failed or outcome.left or outcome.fallback else 0


def _dry_run(parsed: argparse.Namespace, listed: tuple[clips.Clip, ...], settings: Settings) -> int:
    forecast = ahead.plan_ahead(listed, settings, lambda line: print(printable(line), file=sys.stderr))
    if parsed.json:
        print(json.dumps(forecast, indent=1))
    else:
        _show(forecast)
    if forecast["size_bytes"] > forecast["free_bytes"]:
        needed, free = _megabytes(forecast)
        raise InputError(f"{parsed.output}: needs {needed}, found {free} free; make space first")
    return EXIT_FALLBACK if forecast["failed"] else 0


def _show(forecast: dict[str, Any]) -> None:
    to_do = forecast["clips"] - len(forecast["kept"]) - len(forecast["failed"])
    end = time.strftime("%Y-%m-%d %H:%M", time.localtime(time.time() + forecast["wall_s"]))
    kept = f", {len(forecast['kept'])} are done" if forecast["kept"] else ""
    print(f"clips     {to_do} to do, {forecast['video_s']:.1f} s of video{kept}")
    for name, rate in forecast["seconds"].items():
        plan = printable(Path(name).stem)
        print(f"cost      {rate:.1f} s on one core per second of video, plan {plan}, measured now")
    print(
        f"time      {duration(forecast['wall_s'])} with {forecast['jobs']} at once, until {end} if begun now"
    )
    print("disk      {} of {} free".format(*_megabytes(forecast)))
    for name, message in forecast["failed"].items():
        print(f"bad       {printable(name)}: {printable(message)}")


def _megabytes(forecast: dict[str, Any]) -> tuple[str, str]:
    """What the results will need, and what is free."""
    needed, free = (f"{forecast[key] / 1e6:.1f} MB" for key in ("size_bytes", "free_bytes"))
    return needed, free


class _Shown:
    """A bar on a terminal, lines elsewhere, on stderr."""

    def __init__(self) -> None:
        self._bar: Progress | None = None

    def say(self, line: str) -> None:
        """A line of its own."""
        clear = "\r\x1b[K" if self._bar is not None and sys.stderr.isatty() else ""
        print(f"{clear}{printable(line)}", file=sys.stderr, flush=True)

    def progress(self, done: float, total: float, note: str) -> None:
        """Seconds of video."""
        if self._bar is None:
            self._bar = Progress(total, "batch", interval_s=60.0).__enter__()
        self._bar.update(done, note)

    def end(self) -> None:
        """Close the bar."""
        if self._bar is not None:
            self._bar.__exit__(None, None, None)
