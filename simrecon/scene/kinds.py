"""The kinds of things, as data (models/scene/kinds.toml), and the checks of their parameters."""

from __future__ import annotations

import difflib
import functools
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from simrecon import resources
from simrecon.errors import InputError
from simrecon.types import Value

LARGEST_M = 1000.0


@dataclass(frozen=True)
class Parameter:
    """One parameter of a kind.

    Attributes:
        name: with its unit.
        type: `number`, `vector`, `count`, `flag` or `text`.
        meaning: for the documentation.
        low, high: bounds; above: the lower bound itself is not allowed.
        default: None where it must be given.
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
    """One kind of thing."""

    name: str
    about: str
    movable: bool
    parameters: tuple[Parameter, ...]


@functools.cache
def table() -> dict[str, Kind]:
    """All kinds by name."""
    found = {}
    for name, entry in resources.toml("models", "scene", "kinds.toml").items():
        parameters = tuple(_parameter(key, given) for key, given in entry["parameters"].items())
        found[name] = Kind(name, entry["about"], entry.get("movable", False), parameters)
    return found


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


def parameters(of: Kind, given: Mapping[str, Any], where: str) -> dict[str, Value]:
    """All parameters of an item of a kind, checked, with defaults for what is left out.

    Raises:
        InputError: one is missing, unknown or out of its range.
    """
    found: dict[str, Value] = {}
    for parameter in of.parameters:
        if parameter.name in given:
            found[parameter.name] = value(given[parameter.name], parameter, where)
        elif parameter.default is not None:
            found[parameter.name] = parameter.default
        else:
            needed = ", ".join(p.name for p in of.parameters if p.default is None)
            raise InputError(f"{where} lacks the key {parameter.name!r}; needed: {needed}")
    return found


def value(given: Any, parameter: Parameter, where: str) -> Value:
    """A value given for a parameter, checked.

    Raises:
        InputError: it is of another type or out of its range.
    """
    name = parameter.name
    if parameter.type == "flag":
        if not isinstance(given, bool):
            raise InputError(f"{where} {name} must be true or false, found {given!r}")
        return given
    if parameter.type == "text":
        return _text(given, parameter, where)
    if parameter.type == "vector":
        return vector(given, name, where, parameter.low, parameter.high)
    if parameter.type == "count":
        if (
            isinstance(given, bool)
            or not isinstance(given, int)
            or not parameter.low <= given <= parameter.high
        ):
            rule = f"a whole number from {parameter.low:g} to {parameter.high:g}"
            raise InputError(f"{where} {name} must be {rule}, found {given!r}")
        return given
    return number(given, name, where, parameter.low, parameter.high, parameter.above)


def _text(given: Any, parameter: Parameter, where: str) -> str:
    if not isinstance(given, str) or not given.strip() or not given.isprintable():
        raise InputError(f"{where} {parameter.name} must be text in quotes, found {given!r}")
    if parameter.valid and given not in parameter.valid:
        valid = ", ".join(parameter.valid)
        raise InputError(
            f"{where} {parameter.name} {given!r} is unknown{hint(given, parameter.valid)}; valid: {valid}"
        )
    return given


def number(given: Any, name: str, where: str, low: float, high: float, above: bool = False) -> float:
    """A number within its bounds.

    Raises:
        InputError: it is none, or out of them.
    """
    found = _as_float(given)
    if found is None or not low <= found <= high or (above and found == low):
        rule = f"above {low:g} and at most {high:g}" if above else f"from {low:g} to {high:g}"
        raise InputError(f"{where} {name} must be a number {rule}, found {given!r}")
    return found


def vector(
    given: Any, name: str, where: str, above: float = -LARGEST_M, high: float = LARGEST_M
) -> tuple[float, float, float]:
    """Three numbers within bounds.

    Raises:
        InputError: they are not.
    """
    values = [_as_float(entry) for entry in given] if isinstance(given, list | tuple) else []
    numbers = [entry for entry in values if entry is not None and above < entry <= high]
    if len(values) != 3 or len(numbers) != 3:
        rule = f"above {above:g} and at most {high:g}"
        raise InputError(f"{where} {name} must be three numbers [x, y, z] {rule}, found {given!r}")
    return numbers[0], numbers[1], numbers[2]


def check_keys(
    where: str, given: Mapping[str, Any], valid: Collection[str], required: Collection[str] = ()
) -> None:
    """Check that a table holds what it must and nothing else.

    Raises:
        InputError: it doesn't; the message lists what is valid.
    """
    for key in given:
        if key not in valid:
            raise InputError(f"{where} unknown key {key!r}{hint(key, valid)}; valid: {', '.join(valid)}")
    for key in required:
        if key not in given:
            raise InputError(f"{where} lacks the key {key!r}; needed: {', '.join(required)}")


def hint(word: str, valid: Collection[str]) -> str:
    """`, did you mean …?` where a valid word is close."""
    close = difflib.get_close_matches(word, valid, n=1)
    return f", did you mean {close[0]!r}?" if close else ""


def _as_float(given: Any) -> float | None:
    if isinstance(given, bool) or not isinstance(given, int | float) or not abs(given) < 1e300:
        return None
    return float(given)
