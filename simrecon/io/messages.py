"""Parts of messages about files: what was written, what is close to it, which keys are valid."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from simrecon.errors import InputError

_SHOWN = 100


def shown(value: Any) -> str:
    """A value for a message, shortened, in one line."""
    try:
        line = repr(value)
    except (ValueError, RecursionError):  # a number of thousands of digits, tables within tables
        return f"{type(value).__name__} too large to show"
    return line if len(line) <= _SHOWN else f"{line[: _SHOWN - 1]}…"


def counted(number: int, thing: str, things: str = "") -> str:
    """A number of things: `1 frame`, `2 frames`.

    Args:
        number: how many.
        thing: one of them.
        things: several, if that is not `thing` with an `s`.
    """
    return f"{number} {thing if number == 1 else things or thing + 's'}"


def hint(word: str, valid: Collection[str]) -> str:
    """`, did you mean …?` where a valid word is close."""
    close = difflib.get_close_matches(word, valid, n=1)
    return f", did you mean {close[0]!r}?" if close else ""


def check_keys(
    where: str, table: Mapping[str, Any], valid: Collection[str], needed: Collection[str] = ()
) -> None:
    """Check that a table holds what it must and nothing else.

    Raises:
        InputError: it doesn't; the message lists what is valid.
    """
    for key in table:
        if key not in valid:
            near, names = hint(str(key), valid), ", ".join(valid)
            raise InputError(f"{where} unknown key {shown(key)}{near}; valid: {names}")
    for key in needed:
        if key not in table:
            raise InputError(f"{where} lacks the key {key!r}; needed: {', '.join(needed)}")


def spans(numbers: Sequence[int]) -> str:
    """Increasing numbers of frames as `frames 3-5, 9`."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1][1:] = [number]
        else:
            runs.append([number])
    words = ", ".join("-".join(str(end) for end in run) for run in runs)
    return f"{'frame' if len(numbers) == 1 else 'frames'} {words}"
