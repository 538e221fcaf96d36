"""Manifests: tables of clips in TOML or CSV, each row with its input and what is asked of it."""

from __future__ import annotations

import csv
import io
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from simrecon import engines, planners
from simrecon.batch import files
from simrecon.errors import InputError
from simrecon.io import tables
from simrecon.io.messages import check_keys
from simrecon.io.reading import TEXT_MAX_BYTES, read_bytes
from simrecon.job.text import Option, over
from simrecon.job.text import options as job_options

SUFFIXES = (".toml", ".csv")
NEWER_KEYS = {"person_at": "person_at_px", "width_px": "size_px", "height_px": "size_px"}
"""Keys of manifests that were options of their own, and the options that they have become."""
OLDER_KEYS = tuple(NEWER_KEYS)


@dataclass(frozen=True)
class ManifestTable:
    """A manifest in TOML: `[[clip]]` for each row, and `[defaults]` of all."""

    clip: tuple[Mapping[str, Any], ...]
    defaults: Mapping[str, Any] = tables.option({})


@dataclass(frozen=True)
class ManifestRow:
    """The keys of a row that are no options of a job."""

    name: str | None = tables.text(None)
    input: str | None = tables.text(None)
    plan: str | None = tables.text(None)
    scene: str | None = tables.text(None)
    contacts: str | None = tables.text(None)
    planner: str | None = tables.option(None, choices=planners.names)
    engine: str | None = tables.option(None, choices=engines.names)


OPTIONS = {option.name: option for option in job_options()}
_OWN = tables.keys(ManifestRow)
KEYS = (*_OWN, *OPTIONS, *OLDER_KEYS)


@dataclass(frozen=True)
class Entry:
    """One input of a manifest.

    Attributes:
        name: that its row gives, or None.
        path: of the input; root: folder in which it was found, None if it was named itself.
        values: fields of the clip and options of its job, by name; paths are absolute or as seen from here.
        shared: names of the values that stand in [defaults].
    """

    name: str | None
    path: Path
    root: Path | None
    values: Mapping[str, Any]
    shared: Collection[str] = ()


def read(path: Path) -> list[Entry]:
    """The inputs of a manifest, row by row.

    Raises:
        InputError: it can't be read, has an unknown key or impossible value, or an input is not there.
    """
    rows, shared = _toml(path) if path.suffix.lower() == ".toml" else _csv(path)
    entries: list[Entry] = []
    for where, row in rows:
        own = _checked(where, over(shared, row), path.resolve().parent)
        if "input" not in own:
            raise InputError(f"{where} lacks the key 'input'; valid: {', '.join(KEYS)}")
        found = files.find(own.pop("input"))
        name = own.pop("name", None)
        if name is not None and len(found) > 1:
            raise InputError(f"{where} name: found one for {len(found)} inputs; valid: leave it out")
        common = set(own) - {NEWER_KEYS.get(key, key) for key in row}
        entries += [Entry(name, file, root, own, common) for file, root in found]
    return entries


def _toml(path: Path) -> tuple[list[tuple[str, Mapping[str, Any]]], dict[str, Any]]:
    content = tables.read(ManifestTable, path, "manifest")
    if not content.clip:
        raise InputError(f"{path}: found no [[clip]]; valid: one for each clip")
    if own := {"name", "input"} & set(content.defaults):
        raise InputError(f"{path}: [defaults] {min(own)}: found one for all clips; valid: in [[clip]]")
    rows = [(f"{path}: [[clip]] {i}:", row) for i, row in enumerate(content.clip, 1)]
    return rows, dict(content.defaults)


def _csv(path: Path) -> tuple[list[tuple[str, Mapping[str, Any]]], dict[str, Any]]:
    """Rows of a table with a header; an empty cell is no value, and a row of empty cells is none."""
    try:
        text = read_bytes(path, TEXT_MAX_BYTES).decode("utf-8-sig")
        reader = csv.DictReader(io.StringIO(text, newline=""), skipinitialspace=True)
        rows: list[tuple[str, dict[Any, Any]]]
        rows = [(f"{path}: line {reader.line_num}:", row) for row in reader if not _is_empty(row)]
        header = reader.fieldnames or ()
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: cannot be read as CSV: {error}") from error
    if "input" not in header or not rows:
        raise InputError(f"{path}: found no column 'input', or no rows; valid columns: {', '.join(KEYS)}")
    for where, row in rows:
        if any(cell.strip() for cell in row.pop(None, ())) or None in row.values():
            raise InputError(f"{where} found a row that is not as long as the header ({len(header)} columns)")
    return [
        (where, {key: cell.strip() for key, cell in row.items() if cell.strip()}) for where, row in rows
    ], {}


def _is_empty(row: Mapping[str | None, Any]) -> bool:
    """Whether a spreadsheet left nothing but separators in a row, however many."""
    cells = [cell for value in row.values() for cell in (value if isinstance(value, list) else [value])]
    return not any(cell and cell.strip() for cell in cells)


def _checked(where: str, row: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """The values of a row, of their types; paths are relative to the manifest."""
    values: dict[str, Any] = {}
    check_keys(where, row, KEYS)
    for key, value in _renamed(where, row).items():
        if key in OPTIONS:
            values[key] = _option(f"{where} {key}", OPTIONS[key], value)
        else:
            values[key] = tables.check(_OWN[key], value, where)
        if key == "name" and files.safe(value) != value:
            raise InputError(
                f"{where} name: found {value!r}; valid: a file name such as {files.safe(value)!r}"
            )
        values[key] = _path(f"{where} {key}", key, values[key], folder)
    return values


def _renamed(where: str, row: Mapping[str, Any]) -> dict[str, Any]:
    """A row with the older keys under the names of today's options."""
    values = dict(row)
    if "person_at" in values:
        values["person_at_px"] = values.pop("person_at")
    sides = [values.pop(key, None) for key in ("width_px", "height_px")]
    if sides != [None, None]:
        if None in sides:
            raise InputError(f"{where} found one of width_px and height_px; valid: both, or size_px")
        values["size_px"] = f"{sides[0]}x{sides[1]}"
    return values


def _option(where: str, option: Option, value: Any) -> Any:
    """A value of TOML, or a cell of a table, as that of an option."""
    try:
        return option.parse(value) if isinstance(value, str) else option.check(value)
    except InputError as error:
        raise InputError(f"{where} {error}") from error


def _path(where: str, key: str, value: Any, folder: Path) -> Any:
    """A file's path as seen from the manifest's folder; other values as they are."""
    is_file = key in ("input", "scene", "contacts") or (key in OPTIONS and OPTIONS[key].rules.get("file"))
    if not is_file and key != "plan":
        return value
    inside = folder / Path(value).expanduser()
    if key == "plan":
        return str(inside) if inside.is_file() else value
    if key != "input" and not inside.exists():
        raise InputError(f"{where}: found no file {inside}")
    return str(inside)
