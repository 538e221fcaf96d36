"""Numbers and lists deep in a JSON file, checked."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from simrecon.evidence.content import Content
from simrecon.evidence.values import as_array, bounded
from simrecon.io.limits import NUMBER_MAX
from simrecon.io.messages import counted
from simrecon.types import Array

# Confidences: 0 to 1, or a visibility of 0 to 2; some networks exceed that.
SCORES = (-0.5, 10.0)


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
    return bounded(content, key, array.astype(float))


def whole(content: Content, key: str, value: Any) -> int:
    """A whole number, such as that of a frame; `key` is its place, for messages."""
    single = as_array(value)
    number = (
        float(single) if single is not None and single.ndim == 0 and single.dtype.kind in "fiu" else np.nan
    )
    if not abs(number) <= NUMBER_MAX:
        raise content.fail(key, f"{value!r:.40}", "a whole number")
    return int(number)


def lacks(one: Any, key: str) -> bool:
    """Whether the value of a key is null or an empty list, as some write a person without landmarks."""
    if not isinstance(one, Mapping) or key not in one:
        return False
    return one[key] is None or (isinstance(one[key], (list, tuple)) and not len(one[key]))


def triples(content: Content, key: str, value: Any, count: int) -> Array:
    """A flat list of x, y and confidence, (J, 3), or a list of such triples."""
    flat = floats(content, key, value).reshape(-1)
    if len(flat) % 3 or (count and len(flat) != 3 * count):
        valid = "x, y, confidence of each landmark" + (f", {counted(count, 'landmark')}" if count else "")
        raise content.fail(key, f"{counted(len(flat), 'number')}", valid)
    listed = flat.reshape(-1, 3)
    third = listed[np.isfinite(listed[:, 2]), 2]
    low, high = SCORES
    if ((third < low) | (third > high)).any():
        text = f"third numbers from {third.min():.3g} to {third.max():.3g}, which are no confidences"
        raise content.fail(
            key, text, "x, y in pixels and confidence; 3D joints in a format that is known for them"
        )
    return listed


def numbers(names: Sequence[str]) -> tuple[list[int], str]:
    """Numbers of frames from the names of their files, and a word on it where they are not the last ones.

    That is the last number in each name; else the one that is another in each; else the order of the names.
    """
    stems = [re.sub(r"_keypoints$", "", _stem(name)) for name in names]
    digits = [re.findall(r"\d+", stem) for stem in stems]
    for back in range(1, min((len(found) for found in digits), default=0) + 1):
        values = [int(found[-back]) for found in digits]
        if len(set(values)) == len(values) and max(values) < NUMBER_MAX:
            note = (
                "" if back == 1 else f"frames numbered by the number before the last {back - 1} in the names"
            )
            return values, note
    natural = sorted(
        range(len(names)), key=lambda i: [_natural(word) for word in re.split(r"(\d+)", stems[i])]
    )
    order = {i: rank for rank, i in enumerate(natural)}
    note = (
        "no number in the names tells the frames apart: in the order of the names" if len(names) > 1 else ""
    )
    return [order[i] for i in range(len(names))], note


def _natural(word: str) -> tuple[int, int, str]:
    return (0, int(word), "") if word.isdecimal() else (1, 0, word)


def _stem(name: str) -> str:
    return name.rsplit("/", 1)[-1].rsplit(".", 1)[0]


def number(name: str, fallback: int) -> int:
    """The last number in a file name without its ending: that of the frame."""
    digits = re.findall(r"\d+", _stem(name))
    return int(digits[-1]) if digits and int(digits[-1]) < NUMBER_MAX else fallback
