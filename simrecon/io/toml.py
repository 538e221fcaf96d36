"""TOML text ↔ plain tables; `simrecon.io.tables` makes dataclasses of them."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import tomlkit

from simrecon.errors import InputError
from simrecon.io import reading
from simrecon.io.limits import size_text

MAX_BYTES = 8 << 20
"""Of a file, for Python's reader takes a second or two for each million."""
MAX_DEPTH = 64
"""Tables and lists within each other."""
_MOST_BITS = 14_000  # Python shows no number of more than 4,300 digits
_PART = r"""(?:[A-Za-z0-9_-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![A-Za-z0-9_-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MAX_DEPTH}}}")
"""A key of more parts than that, for each of which Python's reader keeps a copy of all before it."""


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
        raw = reading.read_bytes(path, MAX_BYTES)
        content = raw.decode("utf-8", "surrogateescape" if any_bytes else "strict")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot read the {noun}: {reason}") from error
    return loads(content, str(path))


def loads(content: str, where: str) -> dict[str, Any]:
    """The tables in the text of a TOML file, which `where` names in messages.

    Raises:
        InputError: it is not TOML, is nested more than `MAX_DEPTH` deep, or has a whole number of
            thousands of digits.
    """
    try:
        if len(content) > MAX_BYTES:
            raise ValueError(f"more than {size_text(MAX_BYTES)}")
        if _LONG_KEY.search(content):
            raise ValueError(f"a key of more than {MAX_DEPTH} parts")
        tree = tomllib.loads(content)
        _check(tree)
    except RecursionError as error:
        raise InputError(f"{where}: not valid TOML: nested too deeply") from error
    except ValueError as error:
        raise InputError(f"{where}: not valid TOML: {error}") from error
    return tree


def _check(tree: dict[str, Any]) -> None:
    """Check that all of a tree can be shown."""
    level: list[Any] = [tree]
    for _ in range(MAX_DEPTH):
        inner = [value for table in level for value in _values(table)]
        if any(isinstance(value, int) and value.bit_length() > _MOST_BITS for value in inner):
            raise ValueError("a whole number of thousands of digits")
        level = [value for value in inner if isinstance(value, dict | list)]
    if level:
        raise ValueError(f"nested more than {MAX_DEPTH} deep")


def _values(table: Any) -> Iterable[Any]:
    return table.values() if isinstance(table, dict) else table


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
