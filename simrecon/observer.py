"""What is told of a run while it goes on, and may stop it."""

from __future__ import annotations

from collections.abc import Sequence

from simrecon.types import Window, WindowResult


class Observer:
    """Is told of the progress of a run; each method does nothing unless a subclass has its own.

    An exception that a method raises ends the run; windows that were solved stay in the checkpoints.
    """

    def note(self, line: str) -> None:
        """A line for the user, such as how the input was read."""

    def stage(self, name: str, done: float, total: float) -> None:
        """How much of a stage is done, in its own unit: frames of a video, seconds of the clip, trials."""

    def resumed(self, known: Sequence[WindowResult], windows: Sequence[Window]) -> None:
        """The simulation begins: windows that earlier runs have solved, and all there are."""

    def solved(self, result: WindowResult, windows: Sequence[Window]) -> None:
        """A window was solved, and kept if the run keeps checkpoints."""


SILENT = Observer()
"""Of a run that nobody watches."""
