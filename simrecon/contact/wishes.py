"""`contacts.toml` (`simrecon.contacts/1`): which parts touch when, as a user wishes it."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from simrecon.contact.parts import names
from simrecon.errors import InputError
from simrecon.io import tables, toml
from simrecon.io.messages import check_keys, shown
from simrecon.types import Array, ContactLabels, ContactTargets, ContactWish, Flags, Interval, runs

SCHEMA = "simrecon.contacts/1"
MODES = ("auto", "always", "never", "grounded")
KINDS = ("touch", "free", "auto")
"""Of intervals."""
INTERVALS_MAX = 10_000
"""Of a part; each is looked for in all frames."""
_Intervals = tuple[tuple[float, float], ...]


@dataclass(frozen=True, kw_only=True)
class WishTable:
    """The table of a part: `found` is what was found when the file was written, and asks for nothing."""

    mode: str = tables.choice(*MODES, default="auto")
    found: _Intervals = ()
    touch: _Intervals = ()
    free: _Intervals = ()
    auto: _Intervals = ()


def read(path: Path | str) -> tuple[ContactWish, ...]:
    """Read the wishes of a file.

    Raises:
        InputError: it can't be read, is not TOML, or holds an unknown part or key, or an impossible value.
    """
    table = toml.load(path, "contacts")
    schema = table.pop("schema", None)
    if schema != SCHEMA:
        raise InputError(f"{path}: schema is {shown(schema)}; valid: {SCHEMA!r}")
    return build(table, str(path))


def build(table: Any, where: str) -> tuple[ContactWish, ...]:
    """Wishes from the tables of the parts, those that ask for something; `where` is named in errors.

    Raises:
        InputError: as `read`.
    """
    if not isinstance(table, Mapping):
        raise InputError(f"{where}: must be a table of parts; valid: {', '.join(names())}")
    check_keys(f"{where}:", table, names())
    made = tuple(_wish(part, table[part], where) for part in names() if part in table)
    return tuple(wish for wish in made if wish != ContactWish(wish.part))


def _wish(part: str, table: Any, where: str) -> ContactWish:
    values = tables.build(WishTable, table, where, section=part)
    wish = ContactWish(part, values.mode, values.touch, values.free, values.auto)
    spans = sorted((*span, kind) for kind in KINDS for span in getattr(wish, kind))
    if len(spans) > INTERVALS_MAX:
        raise InputError(f"{where}: [{part}] found {len(spans)} intervals; valid: at most {INTERVALS_MAX}")
    for kind in (*KINDS, "found"):
        for low, high in getattr(values, kind):
            if not low < high:
                found = f"{where}: [{part}] {kind}: found [{low:g}, {high:g}]"
                raise InputError(f"{found}; valid: [from, to] in seconds, the first one less")
    for (_, high, first), (low, _, second) in itertools.pairwise(spans):
        if low < high:
            raise InputError(
                f"{where}: [{part}] found {first} up to {high:g} s and {second} from {low:g} s; "
                f"valid: intervals that do not overlap"
            )
    return wish


def to_table(wishes: Sequence[ContactWish]) -> dict[str, Any]:
    """The tables of the parts, from which `build` makes equal wishes."""
    return {wish.part: _plain(wish) for wish in wishes}


def _plain(wish: ContactWish) -> dict[str, Any]:
    intervals = {kind: tables.plain(getattr(wish, kind)) for kind in KINDS if getattr(wish, kind)}
    return {"mode": wish.mode, **intervals}


def dumps(wishes: Sequence[ContactWish], found: Mapping[str, Sequence[Interval]] | None = None) -> str:
    """The text of a file; what was `found` to touch, by part, stands beside the wishes."""
    asked = {wish.part: wish for wish in wishes}
    lines = [f'schema = "{SCHEMA}"', "# times in seconds; found: what touched, and asks for nothing"]
    lines.append(
        "# mode: auto, always, never, grounded; touch, free, auto: intervals that come before the mode"
    )
    for part in names():
        if found is None and part not in asked:
            continue
        wish = asked.get(part, ContactWish(part))
        lines += ["", f"[{part}]", f'mode = "{wish.mode}"']
        if found is not None:
            lines.append(f"found = {_listed(found.get(part, ()))}")
        kinds = KINDS[:2] if found is not None else ()
        lines += [f"{k} = {_listed(getattr(wish, k))}" for k in KINDS if k in kinds or getattr(wish, k)]
    return "\n".join(lines) + "\n"


def _listed(spans: Sequence[Interval]) -> str:
    return "[" + ", ".join(f"[{low!r}, {high!r}]" for low, high in spans) + "]"


def check_times(wishes: Sequence[ContactWish], times_s: Array, where: str = "--contacts") -> None:
    """Refuse intervals that hold no frame of a clip.

    Raises:
        InputError: one lies outside the clip, or between two frames.
    """
    first, last = float(times_s[0]), float(times_s[-1])
    for wish in wishes:
        for kind in KINDS:
            for span in getattr(wish, kind):
                if not _inside(times_s, span).any():
                    found = f"{where}: [{wish.part}] {kind}: found [{span[0]:g}, {span[1]:g}]"
                    valid = f"valid: seconds from {first:g} to {last:g}"
                    raise InputError(f"{found}, which holds no frame of the clip; {valid}")


def targets(wishes: Sequence[ContactWish], times_s: Array) -> ContactTargets | None:
    """Wishes by frame; None: there are none.

    Args:
        wishes: one a part.
        times_s: (T,).
    """
    if not wishes:
        return None
    parts = names()
    touch, stay, free = np.zeros((3, len(times_s), len(parts)), dtype=np.bool_)
    for wish in wishes:
        column = parts.index(wish.part)
        touch[:, column] = wish.mode in ("always", "grounded")
        stay[:, column] = wish.mode == "always"
        free[:, column] = wish.mode == "never"
        for kind in KINDS:
            for span in getattr(wish, kind):
                rows = _inside(times_s, span)
                touch[rows, column] = stay[rows, column] = kind == "touch"
                free[rows, column] = kind == "free"
    return ContactTargets(parts, touch, stay, free)


def over(labels: ContactLabels, asked: ContactTargets | None) -> ContactLabels:
    """Labels with the wishes over them: 1 where a part is to touch, 0 where it is not."""
    if asked is None:
        return labels
    wished = np.where(asked.free, 0.0, np.where(asked.touch, 1.0, labels.probability))
    return replace(labels, probability=wished)


def spans(flags: Flags, times_s: Array) -> tuple[Interval, ...]:
    """From and to of the runs of flagged frames (T,), s; half a frame on both sides of a single one."""
    half = 0.5 * float(np.median(np.diff(times_s)))
    found = [(float(times_s[rows.start]), float(times_s[rows.stop - 1])) for rows in runs(flags)]
    return tuple((low, high) if low < high else (low - half, high + half) for low, high in found)


def _inside(times_s: Array, span: Interval) -> Flags:
    """Frames (T,) of an interval, its ends included but for rounding."""
    return np.asarray((times_s >= span[0] - 1e-6) & (times_s <= span[1] + 1e-6))
