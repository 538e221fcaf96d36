"""Values of TOML checked against a type and rules, with messages that say what is valid."""

from __future__ import annotations

import types
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from simrecon.errors import InputError
from simrecon.io.messages import hint, shown
from simrecon.io.paths import is_usable

LARGEST = 1e12
"""Limit of a number without one of its own, so that it is finite at least."""
_LARGEST_WHOLE = 2**63 - 1
_COUNTS = {2: "two", 3: "three", 4: "four"}
_REFUSED = object()


def value_of(kind: Any, rules: Mapping[str, Any], value: Any, where: str) -> Any:
    """A value of TOML in its type.

    Args:
        kind: bool, int, float, str, Path, a Literal, a tuple or table of these, or a union.
        rules: `low`, `high`, `above`, `numbers`, `choices`, `line`, `file`, as `fields.option` has them.
        value: as TOML gives it, or as a dataclass holds it.
        where: at the start of the message, such as `"plan.toml: [window] length_s"`.

    Raises:
        InputError: it is of another type, out of range, or none of the choices.
    """
    result = _accepted(kind, rules, value)
    if result is _REFUSED:
        words = choices_of(kind, rules)
        near = hint(value, words) if isinstance(value, str) and value not in words else ""
        raise InputError(f"{where} must be {_noun(kind, rules)}, found {shown(value)}{near}")
    return result


def members(kind: Any) -> tuple[Any, ...]:
    """The members of a union without None; another type alone."""
    if isinstance(kind, types.UnionType) or typing.get_origin(kind) is typing.Union:
        return tuple(member for member in typing.get_args(kind) if member is not types.NoneType)
    return (kind,)


def _accepted(kind: Any, rules: Mapping[str, Any], value: Any) -> Any:
    """The value in its type, or `_REFUSED`."""
    if kind is Any:
        return value
    if members(kind) != (kind,):
        if value is None and types.NoneType in typing.get_args(kind):
            return None
        results = (_accepted(member, rules, value) for member in members(kind))
        return next((result for result in results if result is not _REFUSED), _REFUSED)
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin is Literal:
        return value if any(value == word and type(value) is type(word) for word in inner) else _REFUSED
    if origin is tuple:
        return _accepted_list(inner, rules, value)
    if origin in (dict, Mapping):
        return _accepted_table(inner[1], rules, value)
    if kind is bool:
        return value if isinstance(value, bool) else _REFUSED
    if kind in (int, float):
        return _accepted_number(kind, rules, value)
    return _accepted_text(kind, rules, value)


def _accepted_list(inner: tuple[Any, ...], rules: Mapping[str, Any], value: Any) -> Any:
    if not isinstance(value, list | tuple):
        return _REFUSED
    kinds = inner[:1] * len(value) if inner[-1] is ... else inner
    if len(kinds) != len(value):
        return _REFUSED
    results = tuple(_accepted(kind, rules, entry) for kind, entry in zip(kinds, value, strict=True))
    return _REFUSED if any(result is _REFUSED for result in results) else results


def _accepted_table(inner: Any, rules: Mapping[str, Any], value: Any) -> Any:
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        return _REFUSED
    results = {key: _accepted(inner, rules, entry) for key, entry in value.items()}
    return _REFUSED if any(result is _REFUSED for result in results.values()) else results


def _accepted_number(kind: type, rules: Mapping[str, Any], value: Any) -> Any:
    whole = kind is int
    if isinstance(value, bool) or not isinstance(value, int if whole else int | float):
        return _REFUSED
    limit = _LARGEST_WHOLE if whole else LARGEST
    low, high = rules.get("low", -limit), rules.get("high", limit)
    if not low <= value <= high or not value > rules.get("above", -float("inf")):
        return _REFUSED
    return kind(value) if value in rules.get("numbers", (value,)) else _REFUSED


def _accepted_text(kind: type, rules: Mapping[str, Any], value: Any) -> Any:
    if kind is Path and isinstance(value, Path):
        value = str(value)
    if not isinstance(value, str):
        return _REFUSED
    if kind is Path:
        return Path(value) if is_usable(value) else _REFUSED
    if rules.get("file") and not is_usable(value):
        return _REFUSED
    if rules.get("line") and (not value.strip() or not value.isprintable()):
        return _REFUSED
    choices = choices_of(kind, rules)
    return value if not choices or value in choices else _REFUSED


def choices_of(kind: Any, rules: Mapping[str, Any]) -> tuple[str, ...]:
    """Valid words of a type under rules; empty: any value of the type."""
    choices = rules.get("choices", ())
    words = tuple(choices() if callable(choices) else choices)
    if words:
        return words
    return tuple(
        word
        for member in members(kind)
        for part in (member, *typing.get_args(member))
        if typing.get_origin(part) is Literal
        for word in typing.get_args(part)
    )


def _noun(kind: Any, rules: Mapping[str, Any]) -> str:
    """What a value of a type is, for a message."""
    member, *others = members(kind)
    if others:
        return " or ".join(_noun(entry, rules) for entry in (member, *others))
    origin, inner = typing.get_origin(member), typing.get_args(member)
    if origin is tuple:
        return _list_noun(inner, rules)
    if origin in (dict, Mapping):
        return "a table" if inner[1] is Any else f"a table, each value {_noun(inner[1], rules)}"
    if member in (int, float) and "numbers" in rules:
        return " or ".join(", ".join(f"{number:g}" for number in rules["numbers"]).rsplit(", ", 1))
    if member in (int, float):
        return f"a {'whole ' if member is int else ''}number{_limits(rules)}"
    if member is bool:
        return "true or false"
    if member is Path:
        return "a path in quotes"
    if rules.get("file"):
        return "the path of a file or folder"
    choices = choices_of(member, rules)
    if len(choices) == 1:
        return f'"{choices[0]}"'
    return f"one of {', '.join(choices)}" if choices else "text in quotes"


def _list_noun(inner: tuple[Any, ...], rules: Mapping[str, Any]) -> str:
    count = "" if inner[-1] is ... else f"{_COUNTS.get(len(inner), len(inner))} "
    if inner[0] in (int, float):
        return f"a list of {count}{'whole ' if inner[0] is int else ''}numbers{_limits(rules)}"
    return f"a list{count and f' of {count}'.rstrip()}, each {_noun(inner[0], rules)}"


def _limits(rules: Mapping[str, Any]) -> str:
    low, high, above = rules.get("low"), rules.get("high"), rules.get("above")
    if above is not None:
        return f" above {above:g}" + ("" if high is None else f" and at most {high:g}")
    if low is not None and high is not None:
        return f" from {low:g} to {high:g}"
    if low is not None:
        return f" at least {low:g}"
    return "" if high is None else f" at most {high:g}"
