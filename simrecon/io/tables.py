"""TOML ↔ frozen dataclasses.

A nested dataclass is a table, a tuple of dataclasses an array of tables; a field that may be None or has a
default may be absent. Every other absent key, and every unknown one, is an error of one line.
"""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from simrecon.errors import InputError
from simrecon.io import toml
from simrecon.io.fields import Key, check, choice, from_text, keys, not_in_file, number, option, text
from simrecon.io.values import check_keys, shown

__all__ = [
    "Key", "build", "check", "choice", "dumps", "from_text", "keys", "not_in_file", "number", "option",
    "parse", "plain", "read", "text", "to_table",
]  # fmt: skip

T = TypeVar("T")


def read(kind: type[T], path: Path | str, noun: str = "file") -> T:
    """Read a dataclass from a TOML file.

    Args:
        kind: the dataclass.
        path: of the file.
        noun: what the file is, for messages.

    Raises:
        InputError: it can't be read, is not TOML, or has an unknown, missing or impossible value.
    """
    return build(kind, toml.load(path, noun), str(path))


def parse(kind: type[T], content: str, where: str) -> T:
    """Read a dataclass from the text of a TOML file; `where` is named in messages.

    Raises:
        InputError: as `read`.
    """
    return build(kind, toml.loads(content, where), where)


def build(kind: type[T], table: Any, where: str, section: str = "") -> T:
    """A dataclass from its table.

    Args:
        kind: the dataclass.
        table: as `tomllib` gives it; a value may also be as the dataclass holds it.
        where: the file, and the part of it, for messages.
        section: name of the table within it; empty: it has none.

    Raises:
        InputError: an unknown, missing or impossible value.
    """
    result: T = _build(kind, table, where, section)
    return result


def _build(kind: Any, table: Any, where: str, section: str) -> Any:
    place = f"{where}: [{section}]" if section else f"{where}:"
    if not isinstance(table, Mapping):
        raise InputError(f"{place} must be a table, found {shown(table)}")
    known = keys(kind)
    needed = [key.name for key in known.values() if key.needed and not _may_be_none(key)]
    check_keys(place, table, known, needed)
    values: dict[str, Any] = {}
    for name, value in table.items():
        key = known[name]
        inner, many = _dataclass_of(key.type)
        if inner is None or (value is None and _may_be_none(key)):
            values[name] = check(key, value, place)
        elif many:
            values[name] = _build_all(inner, value, f"{place} {name}", f"{where}: [[{_join(section, name)}]]")
        else:
            values[name] = _build(inner, value, where, _join(section, name))
    absent = {name: None for name, key in known.items() if name not in table and key.needed}
    return kind(**values, **absent)


def _build_all(kind: Any, value: Any, place: str, where: str) -> tuple[Any, ...]:
    if not isinstance(value, list | tuple):
        raise InputError(f"{place} must be a list of tables, found {shown(value)}")
    return tuple(_build(kind, table, f"{where} {i}{_name(table)}", "") for i, table in enumerate(value, 1))


def _name(table: Any) -> str:
    name = table.get("name") if isinstance(table, Mapping) else None
    return f" ({name})" if isinstance(name, str) and name.isprintable() else ""


def _join(section: str, name: str) -> str:
    return f"{section}.{name}" if section else name


def _may_be_none(key: Key) -> bool:
    return types.NoneType in typing.get_args(key.type)


def _dataclass_of(kind: Any) -> tuple[Any, bool]:
    """The dataclass that a type holds, or None; whether it holds a list of them."""
    for member in (kind, *typing.get_args(kind)):
        if isinstance(member, type) and dataclasses.is_dataclass(member):
            return member, typing.get_origin(kind) is tuple
    return None, False


def to_table(value: Any) -> dict[str, Any]:
    """The table of a dataclass, as TOML and JSON can hold it; what is None is left out."""
    kind: Any = type(value)
    table = {name: getattr(value, name) for name in keys(kind)}
    return {name: plain(entry) for name, entry in table.items() if entry is not None}


def plain(value: Any) -> Any:
    """A value as TOML and JSON can hold it; what is None in a table is left out."""
    if dataclasses.is_dataclass(value):
        return to_table(value)
    if isinstance(value, Mapping):
        return {key: plain(entry) for key, entry in value.items() if entry is not None}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    return str(value) if isinstance(value, Path) else value


def dumps(value: Any) -> str:
    """The TOML text of a dataclass, from which `parse` makes an equal one."""
    return toml.dumps(to_table(value))
