"""What is on disk of a batch: its lock, its append-only events (`batch.jsonl`), and where everything lies."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import platform
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from simrecon.errors import InputError, SimreconError
from simrecon.io import atomic, full, reading
from simrecon.system import locks

SCHEMA = "simrecon.batch/1"
LARGEST = 1e15
Event = dict[str, Any]
_TEXTS = ("clip", "input", "plan", "state", "stage", "message", "reason")
_NUMBERS = ("video_s", "window", "windows", "loss", "part")


@dataclass(frozen=True)
class Places:
    """Paths of a batch's folder. A clip's result is the folder of its name."""

    root: Path

    @property
    def events(self) -> Path:
        """The append-only log."""
        return self.root / "batch.jsonl"

    @property
    def page(self) -> Path:
        """The report."""
        return self.root / "index.html"

    @property
    def inner(self) -> Path:
        """All that is not for reading."""
        return self.root / ".batch"

    @property
    def lock(self) -> Path:
        """Held while a batch runs; says whose it is."""
        return self.inner / "lock"

    def result(self, name: str) -> Path:
        """Result folder of a clip."""
        return self.root / name

    def log(self, name: str) -> Path:
        """What was done for a clip, in lines."""
        return self.inner / "logs" / f"{name}.log"

    def checkpoints(self, name: str) -> Path:
        """Solved windows of a clip that is not finished, by key."""
        return self.inner / "checkpoints" / name

    def record(self, name: str) -> Path:
        """Key and figures of a finished clip."""
        return self.inner / "done" / f"{name}.json"

    def thumbnail(self, name: str) -> Path:
        """Strip of frames of a finished clip."""
        return self.inner / "thumbnails" / f"{name}.jpg"

    def clip_lock(self, name: str) -> Path:
        """Held by the process that works on a clip."""
        return self.inner / "locks" / name


def cannot_write(folder: Path | str, error: OSError) -> SimreconError:
    """The error that a failed write ends with."""
    if full.is_full(error):
        return full.stopped(folder)
    return InputError(f"{folder}: cannot be written ({error.strerror or error}); valid: a writable folder")


def write_json(target: Path, content: Any) -> None:
    """Write a file that survives a power cut; its folder is made."""
    target.parent.mkdir(parents=True, exist_ok=True)
    atomic.write_json(target, content, durable=True)


def read_json(path: Path) -> dict[str, Any] | None:
    """A file's table; None where there is none, or it is not whole."""
    try:
        content = json.loads(reading.read_text(path))
    except (OSError, ValueError, RecursionError):
        return None
    return content if isinstance(content, dict) else None


class Journal:
    """Appends events to `batch.jsonl`, one line each, on the disk before it returns."""

    def __init__(self, path: Path) -> None:
        """Open for appending; a line that a power cut left unfinished is closed first."""
        self._stream: IO[bytes] = path.open("ab", buffering=0)
        size = self._stream.tell()
        if size:
            with path.open("rb") as before:
                before.seek(size - 1)
                if before.read(1) != b"\n":
                    self._stream.write(b"\n")

    def append(self, kind: str, **content: Any) -> Event:
        """Write one event, with the time, s since 1970."""
        event = {"time": round(time.time(), 3), "event": kind, **content}
        line = atomic.json_bytes(event)
        written = self._stream.write(line)
        if written != len(line):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return event

    def close(self) -> None:
        """Close the file."""
        with contextlib.suppress(OSError):
            os.fsync(self._stream.fileno())
        self._stream.close()


def read_events(path: Path) -> list[Event]:
    """All events that are whole, in order.

    Raises:
        InputError: there is no such file.
    """
    try:
        text = reading.read_bytes(path).decode("utf-8", "replace")
    except OSError as error:
        raise InputError(
            f"{path.parent}: found no batch there; valid: the folder of `simrecon batch`"
        ) from error
    events = []
    for line in text.split("\n"):
        with contextlib.suppress(ValueError, RecursionError):
            event = json.loads(line)
            if is_event(event):
                events.append(event)
    return events


def is_event(event: Any) -> bool:
    """Whether a value is an event with a time, and what it says is of the types that are shown."""
    return (
        isinstance(event, dict)
        and isinstance(event.get("event"), str)
        and is_number(event.get("time"))
        and all(isinstance(event[key], str) for key in _TEXTS if key in event)
        and all(is_number(event[key]) for key in _NUMBERS if key in event)
    )


def is_number(value: Any) -> bool:
    """Whether a value is a number of a size that can be shown."""
    return isinstance(value, int | float) and abs(value) < LARGEST


@contextlib.contextmanager
def locked(places: Places, run: str) -> Iterator[None]:
    """Hold the folder for one batch: the kernel lets go of it when the process dies, however it dies.

    Raises:
        InputError: another batch holds it, or it can't be written.
    """
    try:
        places.lock.parent.mkdir(parents=True, exist_ok=True)
        stream = places.lock.open("a+", encoding="utf-8")
    except OSError as error:
        raise cannot_write(places.root, error) from error
    with stream:
        try:
            free = locks.acquire(stream)
        except OSError as error:
            raise cannot_write(places.root, error) from error
        if not free:
            holder = read_json(places.lock) or {}
            who = f"process {holder.get('pid', '?')} on {holder.get('host', '?')}"
            raise InputError(
                f"{places.root}: found another batch at work there ({who}); valid: wait for it, or another "
                f"-o; `simrecon batch status {places.root}` shows it"
            )
        try:
            stream.truncate(0)
            json.dump({"run": run, "pid": os.getpid(), "host": platform.node()}, stream)
            stream.flush()
        except OSError as error:
            raise cannot_write(places.root, error) from error
        yield


def holder(places: Places) -> dict[str, Any] | None:
    """Who holds the folder now; None if nobody does."""
    try:
        with places.lock.open("r", encoding="utf-8") as stream:
            if not locks.acquire(stream, shared=True):
                return read_json(places.lock) or {}
    except OSError:
        pass
    return None


def check_alive(places: Places, run: str) -> bool:
    """Whether the batch that a worker works for still is the one that holds the folder."""
    return (read_json(places.lock) or {}).get("run") == run
