"""Numbers and lists deep in a JSON file, checked."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from simrecon.evidence.content import Content
from simrecon.evidence.values import as_array
from simrecon.types import Array


def get(one: Any, key: str) -> Any:
    """The value of a key; None without it, or of what is no dictionary."""
    return one.get(key) if isinstance(one, Mapping) else None


def rows(content: Content, key: str, one: Any, name: str) -> Iterator[Any]:
    """The list of a name; `key` is its place, for messages."""
    listed = get(one, name)
    if not isinstance(listed, list):
        raise content.fail(key, f"a {type(listed).__name__}", "a list")
    return iter(listed)


def floats(content: Content, key: str, value: Any) -> Array:
    """A value as an array of numbers; `key` is its place, for messages."""
    array = as_array(value)
    if array is None or array.dtype.kind not in "fiu":
        raise content.fail(key, "no list of numbers" if value is not None else "no such key", "numbers")
    return array.astype(float)


def triples(content: Content, key: str, value: Any, count: int) -> Array:
    """A flat list of x, y and confidence, (J, 3)."""
    flat = floats(content, key, value).reshape(-1)
    if len(flat) % 3 or (count and len(flat) != 3 * count):
        valid = "x, y, confidence of each landmark" + (f", {count} landmarks" if count else "")
        raise content.fail(key, f"{len(flat)} numbers", valid)
    return flat.reshape(-1, 3)


def number(name: str, fallback: int) -> int:
    """The last number in a file name without its ending: that of the frame."""
    digits = re.findall(r"\d+", name.rsplit("/", 1)[-1].rsplit(".", 1)[0])
    return int(digits[-1]) if digits and len(digits[-1]) < 13 else fallback
