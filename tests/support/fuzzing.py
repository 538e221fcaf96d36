"""Reads damaged files under limits: `python -m tests.support.fuzzing FOLDER SEED FIRST LAST`.

Prints one JSON line for each file on which a reader does anything but make evidence or raise an error of the
project's own: another exception, more than `SECONDS` of processor time, more than `MEMORY` bytes, or a file
that it writes. It must be a process of its own: the limits and the watch on files stay for its lifetime.
"""

from __future__ import annotations

import json
import logging
import os
import resource
import shutil
import signal
import sys
import traceback
import warnings
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from simrecon.errors import SimreconError
from tests.support import corpus, mutations, video_files
from tests.support.corpus import Sample

SECONDS, MEMORY = 5.0, 1 << 30
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
    """Notes what is written while it is awake, but for the cache of videos."""

    def __init__(self, cache: Path) -> None:
        self.cache = str(cache)
        self.awake = False
        self.written: list[str] = []
        sys.addaudithook(self._hear)

    def _hear(self, event: str, arguments: tuple[Any, ...]) -> None:
        if not self.awake:
            return
        opened = event == "open" and isinstance(arguments[2], int) and arguments[2] & WRITING
        if (opened or event in CHANGES) and self.cache not in str(arguments[0]):
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
            corpus.read(sample)
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
    watch = Watch(folder / "cache")
    for sample in samples:  # what is loaded on first use is loaded now
        fault(sample, watch)
    limit()
    for number in range(first, last):
        rng = np.random.default_rng([seed, number])
        sample = samples[number % len(samples)]
        place = folder / "now" / "one"
        path = mutations.mutate(sample.path, place / sample.path.name, rng)
        said = fault(Sample(sample.format, path, sample.options), watch)
        if said is not None:
            print(json.dumps({"number": number, "format": sample.format, "fault": said}), flush=True)
        shutil.rmtree(folder / "now")
    shutil.rmtree(folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *map(int, sys.argv[2:5]))
