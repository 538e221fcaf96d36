"""Progress of long work: one bar with time left on a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from types import TracebackType
from typing import Self, TextIO

_BAR_WIDTH = 28
_TERMINAL_INTERVAL_S = 0.1
_CLEAR_LINE = "\r\x1b[K"


class Progress:
    """Reports how much of some work is done; a context manager.

    On a terminal it redraws one line; elsewhere it prints whole lines, at most one every `interval_s`, and
    one at the end. Time left = time spent · (total - done) / done.

    Args:
        total: amount of work in any unit; may be fractional.
        label: what is being done.
        stream: where to write; standard error if None.
        interval_s: least time between two plain lines.
        clock: seconds, monotonic.
    """

    def __init__(
        self,
        total: float,
        label: str,
        stream: TextIO | None = None,
        *,
        interval_s: float = 10.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._total = total
        self._label = label
        self._stream = sys.stderr if stream is None else stream
        self._terminal = self._stream.isatty()
        self._full, self._empty = _bar_characters(self._stream)
        self._interval_s = _TERMINAL_INTERVAL_S if self._terminal else interval_s
        self._clock = clock
        self._start_s = self._shown_s = clock()
        self._done = 0.0
        self._note = ""

    def __enter__(self) -> Self:
        """Start the clock."""
        self._start_s = self._shown_s = self._clock()
        if self._terminal:
            self._show(self._start_s)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Write the last state, whether the work ended or failed."""
        now = self._clock()
        self._show(now, end="\n", outcome="done" if kind is None else "stopped")

    def update(self, done: float, note: str = "") -> None:
        """Say how much is done so far.

        Args:
            done: in the unit of `total`, since the start (not since the last call).
            note: a few words shown at the end of the line.
        """
        self._done, self._note = done, note
        now = self._clock()
        if now - self._shown_s >= self._interval_s and (self._terminal or done < self._total):
            self._show(now)

    def end(self, done: float) -> None:
        """Write the last state, that so much was done, without a line of its own for the time left."""
        self._done, self._note = done, ""
        self.__exit__(None, None, None)

    def _show(self, now: float, end: str = "", outcome: str = "") -> None:
        self._shown_s = now
        spent_s = now - self._start_s
        fraction = min(max(self._done / self._total, 0.0), 1.0) if self._total > 0 else 1.0
        timing = ""
        if outcome:
            timing = f"{outcome} in {duration(spent_s)}"
        elif fraction > 0:
            timing = f"{duration(spent_s * (1 - fraction) / fraction)} left"
        parts = [f"{self._label} {fraction:4.0%}", timing, self._note]
        line = "  ".join(part for part in parts if part)
        if self._terminal:
            filled = round(fraction * _BAR_WIDTH)
            bar = self._full * filled + self._empty * (_BAR_WIDTH - filled)
            self._stream.write(f"{_CLEAR_LINE}{bar} {line}{end}")
        else:
            self._stream.write(line + "\n")
        self._stream.flush()


def _bar_characters(stream: TextIO) -> tuple[str, str]:
    try:
        "█░".encode(getattr(stream, "encoding", None) or "utf-8")
    except (UnicodeEncodeError, LookupError):
        return "#", "-"
    return "█", "░"


def duration(seconds: float) -> str:
    """Format a time span for people: `0.4 s`, `42 s`, `3 min 05 s`, `2 h 07 min`."""
    if seconds < 9.95:
        return f"{max(seconds, 0.0):.1f} s"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"
