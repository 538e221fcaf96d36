"""TOML text ↔ plain tables; `simrecon.io.tables` makes dataclasses of them."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import tomlkit

from simrecon.errors import InputError
from simrecon.io import reading


def load(path: Path | str, noun: str = "file", *, any_bytes: bool = False) -> dict[str, Any]:
    """The tables of a TOML file.

    Args:
        path: of the file.
        noun: what the file is, for messages.
        any_bytes: take bytes that are no UTF-8 as `os.fsdecode` does, for files that hold paths.

    Raises:
        InputError: it can't be read, or is not TOML.
    """
    try:
        raw = reading.read_bytes(path, reading.TEXT_MAX_BYTES)
        content = raw.decode("utf-8", "surrogateescape" if any_bytes else "strict")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot read the {noun}: {reason}") from error
    return loads(content, str(path))


def loads(content: str, where: str) -> dict[str, Any]:
    """The tables in the text of a TOML file, which `where` names in messages.

    Raises:
        InputError: it is not TOML.
    """
    try:
        return tomllib.loads(content)
    except RecursionError as error:
        raise InputError(f"{where}: not valid TOML: nested too deeply") from error
    except ValueError as error:
        raise InputError(f"{where}: not valid TOML: {error}") from error


def dumps(table: dict[str, Any]) -> str:
    """The text of a table of plain values; numbers come back to the last bit.

    What stands in a table itself comes before the tables inside it, and arrays of tables come last.
    """
    document = tomlkit.document()
    for name, value in _ordered(table).items():
        document.add(name, tomlkit.item(value))
    return document.as_string()


def _ordered(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _ordered(value[name]) for name in sorted(value, key=lambda name: _rank(value[name]))}
    return [_ordered(entry) for entry in value] if isinstance(value, list) else value


def _rank(value: Any) -> int:
    """0: a plain value, 1: a table, 2: an array of tables."""
    if isinstance(value, dict):
        return 1
    return 2 if isinstance(value, list) and value and all(isinstance(entry, dict) for entry in value) else 0
