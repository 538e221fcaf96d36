"""Arrays among the values that a file holds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simrecon.evidence.content import Content
from simrecon.io.arrays import Arrays
from simrecon.io.limits import MAX_BYTES, NUMBER_MAX
from simrecon.types import Array


def branch(content: Content, tree: Any, prefix: str) -> Arrays:
    """What can be an array among the values of a dictionary, for the checks that every reader makes.

    Args:
        content: the file, for messages.
        tree: a dictionary.
        prefix: how the keys are called in messages, such as `smpl_params_global.`.

    Raises:
        InputError: no dictionary.
    """
    if not isinstance(tree, Mapping):
        raise content.fail(
            prefix.rstrip(".") or "content", f"a {type(tree).__name__}", "a dictionary of arrays"
        )
    arrays = {
        f"{prefix}{key}": array for key, value in tree.items() if (array := as_array(value)) is not None
    }
    return Arrays(content.source, arrays, content.sha256)


def bounded(content: Content, key: str, values: Array) -> Array:
    """The same numbers, NaN for infinite ones, if no place or score is beyond all sense."""
    values = np.where(np.isfinite(values), values, np.nan)
    if (np.abs(values) > NUMBER_MAX).any():
        raise content.fail(key, f"a number of {np.nanmax(np.abs(values)):.3g}", "coordinates and confidences")
    return values


def as_array(value: Any) -> NDArray[Any] | None:
    """A number, text, array or nested list of numbers as an array; None if it is none."""
    if isinstance(value, np.ndarray):
        return np.asarray(value)
    if isinstance(value, (int, float, str, bool, np.generic)):
        return np.asarray(value)
    if isinstance(value, (list, tuple)) and value:
        count, longest = _extent(value)
        if 4 * count * longest > MAX_BYTES:  # numpy takes as much for each text as for the longest
            return None
        try:
            return np.asarray(value)
        except (ValueError, TypeError, OverflowError):
            return None
    return None


def _extent(value: Any) -> tuple[int, int]:
    """How many values a nested list holds, and the length of its longest text."""
    if isinstance(value, (list, tuple)):
        parts = [_extent(entry) for entry in value]
        return sum(count for count, _ in parts), max((longest for _, longest in parts), default=0)
    return 1, len(value) if isinstance(value, (str, bytes)) else 0
