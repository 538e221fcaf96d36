"""Signals by which a system ends a program."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterator
from typing import NoReturn

_NAMES = ("SIGTERM", "SIGHUP", "SIGBREAK")
ENDING = tuple(signal.Signals[name] for name in _NAMES if name in signal.Signals.__members__)
"""End of a session or of a job: a request, a lost terminal, and on Windows Ctrl-Break or a closed window."""


_received: list[EndedError] = []


class EndedError(KeyboardInterrupt):
    """The program is to end, by the signal of this number."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.number = number


def exit_status(error: KeyboardInterrupt) -> int:
    """What a program returns that a signal ended: 130 after Ctrl-C, 143 after SIGTERM."""
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, EndedError):
        cause = cause.__cause__ or cause.__context__
    return 128 + (signal.SIGINT if cause is None else cause.number)


def received() -> EndedError | None:
    """What a signal raised since `interruptible` was entered, whatever became of it.

    A library that is being loaded may turn it into an error of its own.
    """
    return _received[-1] if _received else None


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """The signals that end a session or a job end the program as Ctrl-C does (`EndedError`)."""

    def interrupt(number: int, _: object) -> NoReturn:
        _received.append(EndedError(number))
        raise _received[-1]

    before = {}
    _received.clear()
    for number in (*ENDING, signal.SIGINT):
        with contextlib.suppress(ValueError):  # not in the main thread
            before[number] = signal.signal(number, interrupt)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def deferred() -> Iterator[None]:
    """A block that no signal ends half-way: one that comes is raised when the block is over."""
    noted: list[int] = []
    before = {}
    for number in (*ENDING, signal.SIGINT):
        with contextlib.suppress(ValueError):  # not in the main thread
            before[number] = signal.signal(number, lambda number, _: noted.append(number))
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        if noted:
            signal.raise_signal(noted[0])
