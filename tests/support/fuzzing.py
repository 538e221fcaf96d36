"""Reads damaged files under limits: `python -m tests.support.fuzzing FOLDER SEED FIRST LAST`.

Prints one JSON line for each file on which a reader does anything but make evidence or raise an error of the
project's own: a signal, another exception, more than `SECONDS` of processor time, more than `MEMORY` bytes,
or a file that it writes. Each file is read by a child of its own, whatever becomes of which is noted. It
must be a process of its own too: the limits and the watch on files stay for its lifetime.
"""

from __future__ import annotations

import contextlib
import json
import logging
import os
import resource
import select
import shutil
import signal
import sys
import tempfile
import traceback
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from simrecon.errors import SimreconError
from tests.support import corpus, mutations, own_files, side_files, video_files
from tests.support.corpus import Sample

SECONDS, WAIT_S, MEMORY = 5.0, 60.0, 1 << 30
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
CHANGES = (
    "os.mkdir",
    "os.rename",
    "os.remove",
    "os.rmdir",
    "os.symlink",
    "os.link",
    "os.truncate",
    "shutil.copyfile",
)


class TooLong(BaseException):
    """Beyond the time; no reader catches it."""


class Watch:
    """Notes what is written while it is awake, but for the cache of videos and folders that are ours."""

    def __init__(self, cache: Path) -> None:
        self.allowed = (str(cache), f"{tempfile.gettempdir()}/simrecon-", os.devnull)
        self.awake = False
        self.written: list[str] = []
        sys.addaudithook(self._hear)

    def _hear(self, event: str, arguments: tuple[Any, ...]) -> None:
        if not self.awake:
            return
        opened = event == "open" and isinstance(arguments[2], int) and arguments[2] & WRITING
        place = str(arguments[0])
        if (opened or event in CHANGES) and not any(word in place for word in self.allowed):
            if place == "file" and arguments[-1] != -1:  # that of a parser's own folder, which is removed
                return
            self.written.append(f"{event} {arguments[0]}")


def limit() -> None:
    """Memory beyond that of now, and an alarm for time."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * os.sysconf("SC_PAGE_SIZE") + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most, most))

    def stop(*_: Any) -> None:
        raise TooLong

    signal.signal(signal.SIGPROF, stop)


def fault(sample: Sample, watch: Watch) -> str | None:
    """What a reader does wrong on a file."""
    watch.written.clear()
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    watch.awake = True
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            (sample.reader or (lambda _: corpus.read(sample)))(sample.path)
    except SimreconError as error:
        if "\n" in str(error):
            return f"more than one line: {str(error)!r}"
    except TooLong:
        return f"more than {SECONDS:g} s; {_place()}"
    except BaseException as error:
        return f"{type(error).__name__}: {error}; {_place()}"
    finally:
        watch.awake = False
        signal.setitimer(signal.ITIMER_PROF, 0)
    return f"wrote {watch.written}" if watch.written else None


def apart(sample: Sample, watch: Watch) -> str | None:
    """`fault` in a child."""
    ours, theirs = os.pipe()
    if (child := os.fork()) == 0:
        said = ""
        with contextlib.suppress(BaseException):
            said = fault(sample, watch) or "-"
        os.write(theirs, said.encode("utf-8", "replace")[:4000])
        os._exit(0)
    os.close(theirs)
    with open(ours, "rb") as stream:
        ready, _, _ = select.select([stream], [], [], WAIT_S)
        if not ready:
            os.kill(child, signal.SIGKILL)
        words = stream.read().decode("utf-8", "replace")
    _, status = os.waitpid(child, 0)
    if not ready:
        return f"more than {WAIT_S:g} s"
    if os.WIFSIGNALED(status):
        return f"signal {os.WTERMSIG(status)}"
    return None if words == "-" else words or "no answer"


def _place() -> str:
    frames = traceback.extract_tb(sys.exc_info()[2])[-4:]
    lines = [f"{Path(frame.filename).name}:{frame.lineno} {frame.name}" for frame in reversed(frames)]
    return " < ".join(lines)


def without_a_network() -> None:
    """Videos are looked at by a stand-in that finds rectangles, and nothing of it is kept."""
    from simrecon.evidence.video import detection, weights

    patch.object(weights, "find", lambda name: (Path(name), f"hash of {name}")).start()
    patch.object(detection, "Networks", lambda *_: video_files.Rectangles()).start()


def main(folder: Path, seed: int, first: int, last: int) -> None:
    """Damage and read the files of numbers `first` to `last` of a seed."""
    warnings.simplefilter("ignore")
    logging.disable()
    os.environ["SIMRECON_CACHE"] = str(folder / "cache")
    without_a_network()
    (folder / "cases").mkdir(parents=True)
    samples = corpus.made(folder / "made") + corpus.cases(folder / "cases")
    samples += own_files.made(folder / "own") + side_files.made(folder / "side")
    watch = Watch(folder / "cache")
    for sample in samples:  # what is loaded on first use is loaded now
        fault(sample, watch)
    limit()
    for number in range(first, last):
        rng = np.random.default_rng([seed, number])
        sample = samples[number % len(samples)]
        place = folder / "now" / "one"
        path = mutations.mutate(sample.path, place / sample.path.name, rng)
        said = apart(replace(sample, path=path), watch)
        if said is not None:
            print(json.dumps({"number": number, "format": sample.format, "fault": said}), flush=True)
        shutil.rmtree(folder / "now")
    shutil.rmtree(folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *map(int, sys.argv[2:5]))
