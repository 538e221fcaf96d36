"""Clips that fail: how, in one line and with the traceback, and what is written of it."""

from __future__ import annotations

import os
import time
import traceback
from typing import Any

from simrecon import results
from simrecon.batch import journal
from simrecon.batch.clips import Clip
from simrecon.batch.journal import Places
from simrecon.errors import InputError, SimreconError
from simrecon.io import full, provenance
from simrecon.results import placing
from simrecon.results.folder import MOTION, REPORT, SCHEMA


class StoppedError(SimreconError):
    """The batch was told to end, or another one took the folder over: what is solved is kept."""


def failure(name: str, error: BaseException) -> dict[str, Any]:
    """How a clip failed: `kind` is `disk`, `stopped`, `input` (the same would come again) or `error`."""
    kind = "input" if isinstance(error, InputError) else "error"
    if full.is_full(error):
        kind = "disk"
    elif isinstance(error, StoppedError):
        kind = "stopped"
    ours = isinstance(error, SimreconError)
    message = str(error) if ours else f"{type(error).__name__}: {error}"
    trace = "" if ours else "".join(traceback.format_exception(error))
    return {"name": name, "kind": kind, "message": " ".join(message.split()), "trace": trace}


def write(places: Places, clip: Clip, failed: dict[str, Any]) -> None:
    """The error as the clip's report; an earlier result is moved aside, what is not ours is left alone."""
    target = places.result(clip.name)
    places.record(clip.name).unlink(missing_ok=True)
    note(places, clip.name, f"failed: {failed['message']}\n{failed['trace']}".rstrip())
    try:
        results.check_writable(target)
    except InputError:
        return
    if (target / MOTION).is_file():
        set_aside(places, clip.name)
    error = {"kind": failed["kind"], "message": failed["message"], "trace": failed["trace"] or None}
    content = {
        "schema": SCHEMA,
        "versions": provenance.versions(),
        "input": {"name": clip.input},
        "plan_name": clip.plan,
        "seed": clip.options.get("seed", 0),
        "error": error,
    }
    journal.write_json(target / REPORT, content)


def set_aside(places: Places, name: str) -> None:
    """Move what is in the place of a clip's result to `.batch/earlier`, where all that was moved so stays."""
    target, aside = places.result(name), places.inner / "earlier" / name
    if target.is_dir():
        aside.parent.mkdir(parents=True, exist_ok=True)
        target.rename(placing.free(aside) if os.path.lexists(aside) else aside)


def note(places: Places, name: str, text: str) -> None:
    """Add to a clip's log."""
    path = places.log(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8", errors="backslashreplace") as stream:
        stream.write(f"{time.strftime('%Y-%m-%d %H:%M:%S')}  {text}\n")
