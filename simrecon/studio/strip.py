"""Contacts on intervals: wishes as they are painted on the strip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from simrecon.contact import parts
from simrecon.contact.wishes import KINDS, MODES
from simrecon.errors import InputError
from simrecon.types import ContactWish, Interval

CLEAR = "clear"
"""Takes back what was painted, so that the mode of the part holds."""
BRUSHES = (*KINDS, CLEAR)
_DIGITS = 3


def painted(wishes: Sequence[ContactWish], part: str, brush: str, span: Interval) -> tuple[ContactWish, ...]:
    """Wishes with an interval painted over them.

    Args:
        wishes: one a part.
        part: name of the part.
        brush: `touch`, `free`, `auto` or `clear`.
        span: from and to, s.

    Raises:
        InputError: there is no such part or brush, or the interval is empty.
    """
    _check("part", part, parts.names())
    _check("brush", brush, BRUSHES)
    low, high = (round(float(value), _DIGITS) for value in sorted(span))
    if not low < high:
        raise InputError(f"interval: found [{low:g}, {high:g}]; valid: [from, to], the first one less")
    known = {wish.part: wish for wish in wishes}
    wish = known.get(part, ContactWish(part))
    cut: dict[str, Any] = {kind: _without(getattr(wish, kind), low, high) for kind in KINDS}
    if brush in KINDS and not (brush == "auto" and wish.mode == "auto"):
        cut[brush] = _joined((*cut[brush], (low, high)))
    known[part] = replace(wish, **cut)
    return _asked(known)


def with_mode(wishes: Sequence[ContactWish], part: str, mode: str) -> tuple[ContactWish, ...]:
    """Wishes with another mode of a part, which holds where nothing is painted.

    Raises:
        InputError: there is no such part or mode.
    """
    _check("part", part, parts.names())
    _check("mode", mode, MODES)
    known = {wish.part: wish for wish in wishes}
    known[part] = replace(known.get(part, ContactWish(part)), mode=mode)
    return _asked(known)


def _check(what: str, given: str, valid: Sequence[str]) -> None:
    if given not in valid:
        raise InputError(f"{what}: found {given!r}; valid: {', '.join(valid)}")


def _asked(known: dict[str, ContactWish]) -> tuple[ContactWish, ...]:
    """Those that ask for something, in the order of the parts."""
    ordered = (known[name] for name in parts.names() if name in known)
    return tuple(wish for wish in ordered if wish != ContactWish(wish.part))


def _without(spans: Sequence[Interval], low: float, high: float) -> tuple[Interval, ...]:
    """Intervals less what lies between two times."""
    left = [(a, min(b, low)) for a, b in spans if a < low]
    right = [(max(a, high), b) for a, b in spans if b > high]
    return tuple(sorted(left + right))


def _joined(spans: Sequence[Interval]) -> tuple[Interval, ...]:
    """Intervals in order, those that meet as one."""
    joined: list[Interval] = []
    for low, high in sorted(spans):
        if joined and low <= joined[-1][1]:
            joined[-1] = (joined[-1][0], max(high, joined[-1][1]))
        else:
            joined.append((low, high))
    return tuple(joined)
