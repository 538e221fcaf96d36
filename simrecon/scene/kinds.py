"""The kinds of items, as data (models/scene/kinds.toml), and the checks of their parameters."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from simrecon import resources
from simrecon.errors import InputError
from simrecon.io import values
from simrecon.io.messages import hint
from simrecon.types import Value

LARGEST_M = 1000.0
_TYPES = {
    "number": float,
    "vector": tuple[float, float, float],
    "count": int,
    "flag": bool,
    "text": str,
}


@dataclass(frozen=True)
class Parameter:
    """One parameter of a kind.

    Attributes:
        name: with its unit.
        type: `number`, `vector`, `count`, `flag` or `text`.
        meaning: one line for the documentation.
        low, high: bounds; above: the lower bound itself is not allowed.
        default: None if the scene file has to state it.
        valid: words that a text may be; empty: any.
    """

    name: str
    type: str
    meaning: str
    low: float
    high: float
    above: bool
    default: Value | None
    valid: tuple[str, ...] = ()


@dataclass(frozen=True)
class Kind:
    """One kind of item."""

    name: str
    about: str
    movable: bool
    parameters: tuple[Parameter, ...]


@functools.cache
def table() -> dict[str, Kind]:
    """All kinds by name."""
    kinds = {}
    for name, entry in resources.toml("models", "scene", "kinds.toml").items():
        parameters = tuple(_parameter(key, rules) for key, rules in entry["parameters"].items())
        kinds[name] = Kind(name, entry["about"], entry.get("movable", False), parameters)
    return kinds


def _parameter(name: str, entry: Mapping[str, Any]) -> Parameter:
    return Parameter(
        name,
        entry["type"],
        entry["meaning"],
        float(entry.get("above", entry.get("low", -LARGEST_M))),
        float(entry.get("high", LARGEST_M)),
        "above" in entry,
        entry.get("default"),
        tuple(entry.get("valid", ())),
    )


def kind(name: str, where: str) -> Kind:
    """The kind of that name.

    Raises:
        InputError: there is none; the message lists those that are.
    """
    if name not in table():
        raise InputError(
            f"{where} kind {name!r} is unknown{hint(name, table())}; valid: {', '.join(table())}"
        )
    return table()[name]


def parameters(kind: Kind, table: Mapping[str, Any], where: str) -> dict[str, Value]:
    """All parameters of an item of a kind, checked, with defaults for what is left out.

    Raises:
        InputError: one is missing or out of its range.
    """
    result: dict[str, Value] = {}
    for parameter in kind.parameters:
        if parameter.name in table:
            result[parameter.name] = value(parameter, table[parameter.name], where)
        elif parameter.default is not None:
            result[parameter.name] = parameter.default
        else:
            needed = ", ".join(entry.name for entry in kind.parameters if entry.default is None)
            raise InputError(f"{where} lacks the key {parameter.name!r}; needed: {needed}")
    return result


def value(parameter: Parameter, value: Any, where: str) -> Value:
    """The value of a parameter, checked.

    Raises:
        InputError: it is of another type or out of its range.
    """
    rules: dict[str, Any] = {"high": parameter.high, "line": True, "choices": parameter.valid}
    rules["above" if parameter.above else "low"] = parameter.low
    result: Value = values.value_of(_TYPES[parameter.type], rules, value, f"{where} {parameter.name}")
    return result
