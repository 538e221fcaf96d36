"""Arrays of a file by key, and the checks that every reader makes, with errors of one line."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from simrecon.errors import InputError
from simrecon.io.limits import NUMBER_MAX
from simrecon.types import Array


@dataclass(frozen=True)
class Arrays:
    """The arrays of one file and the checks that every reader makes; every failure is an `InputError`.

    Attributes:
        source: name of the file, for messages.
        content: arrays by key.
        sha256: of the bytes of the file.
    """

    source: str
    content: Mapping[str, NDArray[Any]]
    sha256: str = ""
    _sizes: dict[str, int] = field(default_factory=dict)

    def __contains__(self, key: str) -> bool:
        """Whether the file has the key."""
        return key in self.content

    def fail(self, key: str, found: str, valid: str) -> NoReturn:
        """Raise the one-line `InputError` of a key."""
        raise InputError(f"{self.source}: {key}: found {found}; valid: {valid}")

    def array(self, key: str) -> NDArray[Any]:
        """The array of a key; a missing one is an error."""
        if key not in self.content:
            self.fail(key, f"no such key (there are {listed(self.content)})", f"a file with the key {key}")
        return self.content[key]

    def floats(self, key: str, shape: tuple[int | str, ...]) -> Array:
        """Real numbers as float64; letters in `shape` are sizes, fixed by the first array that uses them."""
        array = self.array(key)
        sizes = [self._sizes.get(n, n) if isinstance(n, str) else n for n in shape]
        fits = array.ndim == len(shape) and all(
            isinstance(n, str) or n == m for n, m in zip(sizes, array.shape, strict=True)
        )
        if not fits or array.size == 0:
            known = [f"{n} = {m}" for n, m in zip(shape, sizes, strict=True) if n != m]
            self.fail(key, f"shape {array.shape}", ", ".join([f"shape {_tuple(shape)}, not empty", *known]))
        if array.dtype.kind not in "fiu":
            self.fail(key, f"values of type {array.dtype}", "real numbers")
        self._sizes.update({n: m for n, m in zip(shape, array.shape, strict=True) if isinstance(n, str)})
        values: Array = array.astype(np.float64)
        if np.isinf(values).any():
            self.fail(key, "infinite values", "finite numbers, or NaN where the format allows it")
        if (np.abs(values) > NUMBER_MAX).any():
            self.fail(key, f"a number of {np.nanmax(np.abs(values)):.3g}", f"at most {NUMBER_MAX:g}")
        return values

    def finite(self, key: str, shape: tuple[int | str, ...]) -> Array:
        """`floats` without NaN."""
        values = self.floats(key, shape)
        if np.isnan(values).any():
            self.fail(key, f"{int(np.isnan(values).sum())} NaN of {values.size} values", "finite numbers")
        return values

    def scalar(self, key: str, bounds: tuple[float, float], unit: str) -> float:
        """One finite number within bounds."""
        value = float(self.finite(key, ()))
        if not bounds[0] <= value <= bounds[1]:
            self.fail(key, f"{value:g}", f"{bounds[0]:g} to {bounds[1]:g} {unit}")
        return value

    def text(self, key: str, valid: Collection[str]) -> str:
        """One string out of a list."""
        array = self.array(key)
        is_text = array.ndim == 0 and array.dtype.kind == "U"
        if not is_text or str(array) not in valid:
            value = repr(str(array)) if is_text else _described(array)
            self.fail(key, value, " or ".join(repr(v) for v in valid))
        return str(array)

    def names(self, key: str, size: str) -> tuple[str, ...]:
        """A list of different strings; its length is the size that the letter stands for."""
        array = self.array(key)
        if array.ndim != 1 or array.dtype.kind != "U" or array.size == 0:
            self.fail(key, _described(array), f"a list of strings ({size},), not empty")
        names = tuple(str(n) for n in array)
        if twice := sorted({n for n in names if names.count(n) > 1}):
            self.fail(key, f"more than once: {listed(twice)}", "each name once")
        self._sizes[size] = len(names)
        return names


def listed(names: Collection[str]) -> str:
    """Names for a message, those that are no plain word in quotes."""
    return ", ".join(name if name.isidentifier() else repr(name) for name in map(str, names))


def _tuple(shape: tuple[int | str, ...]) -> str:
    return f"({', '.join(map(str, shape))}{',' if len(shape) == 1 else ''})"


def _described(array: NDArray[Any]) -> str:
    return f"shape {array.shape} of type {array.dtype}"
