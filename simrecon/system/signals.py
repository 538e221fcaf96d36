"""Signals by which a system ends a program."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterator
from typing import NoReturn

_NAMES = ("SIGTERM", "SIGHUP", "SIGBREAK")
ENDING = tuple(signal.Signals[name] for name in _NAMES if name in signal.Signals.__members__)
"""End of a session or of a job: a request, a lost terminal, and on Windows Ctrl-Break or a closed window."""


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """The signals that end a session or a job end the program as Ctrl-C does."""

    def interrupt(*_: object) -> NoReturn:
        raise KeyboardInterrupt

    before = {}
    for number in ENDING:
        with contextlib.suppress(ValueError):  # not in the main thread
            before[number] = signal.signal(number, interrupt)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
