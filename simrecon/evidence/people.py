"""Which person of a file is meant."""

from __future__ import annotations

from collections.abc import Mapping

from simrecon.evidence.content import Content
from simrecon.io.messages import counted


def choose(content: Content, frames: Mapping[str, int], choice: str | None, unit: str = "frame") -> str:
    """The person of the user's choice, or the only one.

    Args:
        content: the file, for messages.
        frames: number of frames by name of the person.
        choice: of the user.
        unit: what was counted, if not frames, in the singular.

    Raises:
        InputError: nobody in the file, several and no choice, or no such person.
    """
    there = ", ".join(f"{name} ({counted(number, unit)})" for name, number in frames.items())
    if not frames:
        raise content.fail("people", "no person", "a file with at least one person")
    if choice is not None:
        if choice not in frames:
            raise content.fail("--person", repr(choice), there)
        return choice
    if len(frames) > 1:
        raise content.fail("people", f"{len(frames)}: {there}", "one of them, by --person")
    return next(iter(frames))


def named(frames: Mapping[str, int], person: str) -> str:
    """The choice for the reading; nothing where there was none."""
    return f"person {person} of {len(frames)}" if len(frames) > 1 else ""
