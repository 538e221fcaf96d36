"""Rules beside the fields of a dataclass: what a key of its table may hold."""

from __future__ import annotations

import dataclasses
import functools
import types
import typing
from collections.abc import Callable, Collection, Mapping
from dataclasses import MISSING, dataclass
from typing import Any

from simrecon.io import values

Choices = Collection[str] | Callable[[], Collection[str]]


def option(
    default: Any = MISSING,
    *,
    low: float | None = None,
    high: float | None = None,
    above: float | None = None,
    numbers: tuple[float, ...] | None = None,
    choices: Choices | None = None,
    **more: Any,
) -> Any:
    """A field with rules; those of a list or table hold for each of its values.

    Args:
        default: where the key may be absent; a dictionary or list is copied for each.
        low: smallest valid number.
        high: largest valid number.
        above: the number must be larger than this.
        numbers: the only valid ones.
        choices: valid words, or a function that gives them.
        more: other metadata, such as `help` and `metavar` of a command line.
    """
    rules = {"low": low, "high": high, "above": above, "numbers": numbers, "choices": choices}
    metadata = {key: rule for key, rule in rules.items() if rule is not None} | more
    if isinstance(default, dict | list):
        return dataclasses.field(default_factory=default.copy, metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


def number(low: float | None = None, high: float | None = None, default: Any = MISSING, **more: Any) -> Any:
    """A field for a number from `low` to `high`, both valid; see `option`."""
    return option(default, low=low, high=high, **more)


def choice(*words: str, default: Any = MISSING, **more: Any) -> Any:
    """A field for one of some words, or a list of them; see `option`."""
    return option(default, choices=words, **more)


def text(default: Any = MISSING, **more: Any) -> Any:
    """A field for text of one printable line that is not blank; see `option`."""
    return option(default, line=True, **more)


def not_in_file(default: Any, *, compare: bool = True) -> Any:
    """A field that no table may hold, because something else fills it.

    Args:
        default: until it is filled.
        compare: values that differ in it are not equal.
    """
    return dataclasses.field(default=default, compare=compare, metadata={"in_file": False})


@dataclass(frozen=True)
class Key:
    """A key of a table.

    Attributes:
        name: of the field.
        type: resolved.
        default: where the key is absent; `dataclasses.MISSING` where it is needed.
        rules: the field's metadata.
    """

    name: str
    type: Any
    default: Any
    rules: Mapping[str, Any]

    @property
    def needed(self) -> bool:
        """There is no default."""
        return self.default is MISSING

    @property
    def choices(self) -> tuple[str, ...]:
        """Valid words; empty: any value of the type."""
        return values.choices_of(self.type, self.rules)


@functools.cache
def keys(kind: type) -> Mapping[str, Key]:
    """The keys of a dataclass's table by name, in the order of its fields."""
    hints = typing.get_type_hints(kind)
    fields = [entry for entry in dataclasses.fields(kind) if entry.metadata.get("in_file", True)]
    return types.MappingProxyType(
        {entry.name: Key(entry.name, hints[entry.name], _default(entry), entry.metadata) for entry in fields}
    )


def _default(entry: dataclasses.Field[Any]) -> Any:
    return entry.default if entry.default_factory is MISSING else entry.default_factory()


def check(key: Key, value: Any, where: str) -> Any:
    """A value of a key, of its type.

    Args:
        key: of `keys`; not one that holds a dataclass.
        value: as TOML gives it, or as a dataclass holds it.
        where: before the key's name in the message, such as `"plan.toml: [window]"`.

    Raises:
        InputError: it is of another type, out of range, or none of the choices.
    """
    return values.value_of(key.type, key.rules, value, f"{where} {key.name}")


def from_text(key: Key, word: str, where: str) -> Any:
    """A value from a command line or a cell of a table: `1.5`, `true`, `3,4`; see `check`.

    Raises:
        InputError: as `check`.
    """
    return check(key, _read(values.members(key.type)[0], word), where)


def _read(kind: Any, word: str) -> Any:
    """A word as TOML would give it; a word that can't be read stays one, and is refused later."""
    if typing.get_origin(kind) is tuple:
        return [_read(typing.get_args(kind)[0], part.strip()) for part in word.split(",")]
    if kind is bool:
        return {"true": True, "false": False}.get(word, word)
    if kind in (int, float):
        try:
            return kind(word)
        except (ValueError, OverflowError):
            return word
    return word
