"""`report.json`, read back: what later steps need of it, checked by the same rules as any other table."""

from __future__ import annotations

import contextlib
import dataclasses
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar, cast

from simrecon.errors import InputError
from simrecon.io import tables
from simrecon.io.limits import MISFITS
from simrecon.io.messages import shown
from simrecon.io.reading import read_text
from simrecon.io.tables import number
from simrecon.results.folder import REPORT, SCHEMA
from simrecon.types import Report


@dataclass(frozen=True)
class Source:
    """`input`: the file that was read."""

    name: str = tables.option()
    sha256: str = tables.option("")


@dataclass(frozen=True)
class Person:
    """`person`: who was simulated."""

    height_m: float = number(0.1, 10.0)  # as fitted or estimated, beyond what may be said
    mass_kg: float = number(0.1, 1e4)
    betas: tuple[float, ...] = tables.option(())
    shape_space: str = tables.option("")


@dataclass(frozen=True)
class Frames:
    """`frames`: those in which the person was out of view."""

    interpolated_frames: tuple[int, ...] = tables.option((), low=0)


T = TypeVar("T")


def read(folder: Path | str) -> Report:
    """Read `report.json` of a result folder.

    Raises:
        InputError: it can't be read, or does not say of what, of whom and how the result was made.
    """
    path = Path(folder) / REPORT
    try:
        report = json.loads(read_text(path))
    except (OSError, ValueError, RecursionError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot be read ({why}); valid: the report of a result folder") from error
    if not isinstance(report, dict):
        raise InputError(f"{path}: found no table; valid: the report of a result folder")
    if report.get("schema") != SCHEMA:
        found = report.get("schema")
        raise InputError(f"{path}: schema: found {shown(found)}; valid: {SCHEMA!r}, a result of this version")
    source(report, path)
    person(report, path)
    if not isinstance(report.get("plan_name"), str) or not isinstance(report.get("plan"), Mapping):
        raise InputError(f"{path}: found no plan_name and plan; valid: the report of a result folder")
    return report


@contextlib.contextmanager
def understood(folder: Path | str) -> Iterator[None]:
    """A block that takes values of a report for what they are in one that simrecon has written.

    Raises:
        InputError: one of them is of another kind.
    """
    try:
        yield
    except MISFITS as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        found = f"found a value of another kind than it has there ({reason})"
        raise InputError(f"{Path(folder) / REPORT}: {found}; valid: the report of a result folder") from error


def source(report: Report, path: Path) -> Source:
    """The file that was read."""
    return _part(Source, report, "input", path)


def person(report: Report, path: Path) -> Person:
    """Who was simulated."""
    return _part(Person, report, "person", path)


def frames(report: Report, path: Path) -> Frames:
    """The frames in which the person was out of view."""
    return _part(Frames, report, "frames", path)


def _part(kind: type[T], report: Report, name: str, path: Path) -> T:
    """A table of the report, as far as `kind` has its keys.

    Raises:
        InputError: a key is missing, or holds what it can't.
    """
    table: Any = report.get(name, {})
    known = [item.name for item in dataclasses.fields(cast(Any, kind))]
    if isinstance(table, Mapping):
        table = {key: table[key] for key in known if table.get(key) is not None}
    return tables.build(kind, table, str(path), name)
