"""Progress of a run on a terminal: one bar or line for each stage."""

from __future__ import annotations

import sys

from simrecon.errors import printable
from simrecon.observer import Observer
from simrecon.system.progress import Progress


class Stages(Observer):
    """Shows the stages of a run on stderr; a context manager."""

    def __init__(self) -> None:
        self._bar: Progress | None = None
        self._stage, self._total = "", 0.0

    def __enter__(self) -> Stages:
        """Nothing is shown before the first stage."""
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Close the bar; after an error the message gets a line of its own."""
        if kind is None:
            self._finish()
        elif self._bar is not None and sys.stderr.isatty():
            print(file=sys.stderr)

    def note(self, line: str) -> None:
        """See `Observer`."""
        self._finish()
        print(printable(line), file=sys.stderr)

    def stage(self, name: str, done: float, total: float) -> None:
        """See `Observer`."""
        if name != self._stage:
            self._finish()
            self._stage, self._total = name, total
            self._bar = Progress(total, printable(name)).__enter__()
        if self._bar is not None and done < total:
            self._bar.update(done)

    def _finish(self) -> None:
        if self._bar is not None:
            self._bar.end(self._total)
        self._bar, self._stage = None, ""
