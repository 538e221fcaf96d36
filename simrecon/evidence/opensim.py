"""Readers of OpenSim's TRC (markers) and MOT/STO (columns of numbers) files."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np

from simrecon.errors import InputError
from simrecon.evidence.axes import UNITS_M
from simrecon.evidence.content import open_content
from simrecon.evidence.mocap import trc
from simrecon.types import Array

_HEADER_LINES = 200


@dataclass(frozen=True, eq=False)
class Markers:
    """Markers of a TRC file.

    Attributes:
        times_s: (T,) increasing.
        names: M names, in the file's order.
        points_m: (T, M, 3) in the world, z up, NaN where a marker was not seen.
    """

    times_s: Array
    names: tuple[str, ...]
    points_m: Array

    def of(self, name: str) -> Array:
        """Place of a marker, (T, 3)."""
        return self.points_m[:, self.names.index(name)]


@dataclass(frozen=True, eq=False)
class Columns:
    """The table of a MOT or STO file.

    Attributes:
        times_s: (T,) increasing.
        names: C names, without the time.
        values: (T, C) as they stand in the file: metres, newtons, and degrees or radians.
        in_degrees: whether rotations are in degrees.
        source: name of the file, for messages.
    """

    times_s: Array
    names: tuple[str, ...]
    values: Array
    in_degrees: bool
    source: str = ""

    def vectors(self, prefix: str) -> Array:
        """Columns `<prefix>x`, `<prefix>y`, `<prefix>z` as vectors of the world, z up, (T, 3).

        Raises:
            InputError: there are no such columns.
        """
        columns = [f"{prefix}{axis}" for axis in "xyz"]
        if missing := [name for name in columns if name not in self.names]:
            lacking = f"no column {', '.join(missing)}"
            raise InputError(f"{self.source}: found {lacking}; valid: a file with {', '.join(columns)}")
        return to_world(self.values[:, [self.names.index(name) for name in columns]])


def to_world(vectors: Array) -> Array:
    """OpenSim's axes (x forward, y up, z right) → x forward, y left, z up, (..., 3)."""
    return np.stack((vectors[..., 0], -vectors[..., 2], vectors[..., 1]), axis=-1)


def read_trc(path: str | os.PathLike[str]) -> Markers:
    """Read markers by name; positions come out in metres and in the world.

    Empty cells, and cells that say NaN, are markers that were not seen. `evidence.read` reads the files as
    evidence of one trial; this is for those who need the markers themselves.

    Raises:
        InputError: one line with the file, what was found and what is valid.
    """
    content = open_content(path)
    source = content.source
    if not trc.matches(content):
        raise InputError(f"{source}: found no PathFileType at the start; valid: a TRC file")
    table = trc.parse(content)
    labels, times, places, unit = table.labels, table.times_s, table.places, table.unit.lower()
    if unit not in UNITS_M:
        raise InputError(f"{source}: Units: found {table.unit!r}; valid: {', '.join(UNITS_M)}")
    if len(set(labels)) < len(labels):
        raise InputError(f"{source}: line 4: found {_twice(labels)} more than once; valid: each name once")
    if np.isinf(places).any():
        raise InputError(f"{source}: found infinite values; valid: finite numbers")
    return Markers(_times(source, times), tuple(labels), to_world(places * UNITS_M[unit]))


def read_mot(path: str | os.PathLike[str]) -> Columns:
    """Read a MOT or STO file: a header up to `endheader`, column names that begin with `time`, and numbers.

    Raises:
        InputError: one line with the file, what was found and what is valid.
    """
    content = open_content(path)
    if content.kind != "text":
        raise InputError(f"{content.source}: found a file of kind {content.kind}; valid: a MOT or STO file")
    source, lines = content.source, content.text.splitlines()
    ends = [i for i, line in enumerate(lines[:_HEADER_LINES]) if line.strip().lower() == "endheader"]
    if not ends:
        raise InputError(f"{source}: found no line endheader; valid: a MOT or STO file")
    header = lines[: ends[0]]
    settings = dict(line.split("=", 1) for line in header if line.count("=") == 1)
    degrees = {key.strip().lower(): value.strip().lower() for key, value in settings.items()}.get(
        "indegrees", "no"
    )
    if degrees not in ("yes", "no"):
        raise InputError(f"{source}: inDegrees: found {degrees!r}; valid: yes, no")
    titles = [i for i in range(ends[0] + 1, len(lines)) if lines[i].strip()][:1]
    names = lines[titles[0]].split() if titles else []
    if len(names) < 2 or names[0].lower() != "time" or len(set(names)) < len(names):
        there = f"{_twice(names)} more than once" if len(set(names)) < len(names) else repr(names[:3])
        raise InputError(f"{source}: column names: found {there}; valid: time, then each name once")
    rows = [
        _numbers(source, number, line.split(), len(names))
        for number, line in enumerate(lines[titles[0] + 1 :], start=titles[0] + 2)
        if line.strip()
    ]
    table = _table(source, rows)
    return Columns(_times(source, table[:, 0]), tuple(names[1:]), table[:, 1:], degrees == "yes", source)


def _twice(names: list[str]) -> str:
    return ", ".join(sorted({name for name in names if names.count(name) > 1}))


def _numbers(source: str, line: int, cells: list[str], width: int) -> list[float]:
    """The cells of a row, NaN for empty ones; rows may leave out empty cells at their end."""
    while len(cells) > width and not cells[-1].strip():
        cells = cells[:-1]
    if len(cells) > width:
        raise InputError(f"{source}: line {line}: found {len(cells)} cells; valid: {width}")
    try:
        row = [float(cell) if cell.strip() else float("nan") for cell in cells]
    except ValueError as error:
        raise InputError(f"{source}: line {line}: found a cell that is no number ({error})") from error
    return row + [float("nan")] * (width - len(row))


def _table(source: str, rows: list[list[float]]) -> Array:
    if len(rows) < 2:
        raise InputError(f"{source}: found {len(rows)} rows of numbers; valid: two or more")
    table = np.array(rows)
    if np.isinf(table).any():
        raise InputError(f"{source}: found infinite values; valid: finite numbers")
    return table


def _times(source: str, times: Array) -> Array:
    if not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        raise InputError(
            f"{source}: time: found times that do not increase; valid: increasing times in seconds"
        )
    return times
