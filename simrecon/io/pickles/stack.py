"""What the instructions of a pickle work on: its bytes, the stack with its marks, and the memory."""

from __future__ import annotations

import io
import struct
from typing import Any

import numpy as np

from simrecon.io.limits import size_text
from simrecon.io.pickles.arrays import Shell
from simrecon.io.pickles.budget import Budget

_WHOLE_HASH = 2**61 - 1  # Python hashes smaller whole numbers to themselves, so that few share a place
_TUPLE_KEYS_MAX = 10_000
_TUPLE_KEY_LENGTH_MAX = 8


class Stack:
    """State of a pickle that is read.

    Args:
        stream: at the start of the pickle.
        budget: shared by all pickles of a file.
    """

    def __init__(self, stream: io.BytesIO, budget: Budget) -> None:
        self.stream, self.budget = stream, budget
        self._values: list[Any] = []
        self._below: list[list[Any]] = []  # what is below each mark
        self._memory: dict[int, Any] = {}
        self._tuple_keys = 0

    def take(self, count: int) -> bytes:
        """The next bytes of the pickle."""
        data = self.stream.read(count) if count < 1 << 62 else b""
        if len(data) != count:
            raise EOFError(
                f"it ends too early: {size_text(count)} are needed, {size_text(len(data))} are left"
            )
        return data

    def number(self, layout: str) -> int:
        """A whole number in the layout of `struct`, little-endian."""
        value: int = struct.unpack(f"<{layout}", self.take(struct.calcsize(layout)))[0]
        return value

    def line(self) -> bytes:
        """The rest of the line."""
        line = self.stream.readline()
        if not line.endswith(b"\n"):
            raise EOFError("it ends too early")
        return line[:-1]

    def push(self, value: Any) -> None:
        """Put a value on top."""
        self._values.append(value)

    def pop(self) -> Any:
        """Take the top value."""
        return self._values.pop()

    @property
    def top(self) -> Any:
        """The top value, left there."""
        return self._values[-1]

    def mark(self) -> None:
        """Begin a list of values."""
        self._below.append(self._values)
        self._values = []

    def unmark(self) -> list[Any]:
        """The values since the last mark, which is taken away with them."""
        values, self._values = self._values, self._below.pop()
        return values

    def pop_or_unmark(self) -> None:
        """Drop the top value, or the mark where there is none above it."""
        if self._values:
            self._values.pop()
        else:
            self.drop()

    def drop(self) -> None:
        """Drop the values since the last mark, and the mark."""
        self.unmark()

    def remember(self, index: int | None = None) -> None:
        """Keep the top value, by the next number if none is given."""
        self._memory[len(self._memory) if index is None else index] = self.top

    def recall(self, index: int) -> None:
        """Put what was kept on top: what a shell has come to, where it is filled."""
        value = self._memory[index]
        self.push(value.value if isinstance(value, Shell) and value.value is not None else value)

    def append(self, values: list[Any]) -> None:
        """Add values to the list on top."""
        if type(self.top) is not list:
            raise ValueError(f"values for a {type(self.top).__name__}")
        self.top.extend(values)

    def add(self, values: list[Any]) -> None:
        """Add values to the set on top."""
        if type(self.top) is not set:
            raise ValueError(f"members for a {type(self.top).__name__}")
        self.top.update(map(self.key, values))

    def set_items(self, values: list[Any]) -> None:
        """Add keys and values in turn to the dictionary on top."""
        if not isinstance(self.top, dict) or len(values) % 2:
            raise ValueError(f"items for a {type(self.top).__name__}")
        for key, value in zip(values[::2], values[1::2], strict=True):
            self.top[self.key(key)] = value

    def key(self, value: Any) -> Any:
        """A value that may be a key or a member of a set.

        Others could take hours to be hashed, or all be put in one place.
        """
        if isinstance(value, tuple):
            self._tuple_keys += 1
            if self._tuple_keys > _TUPLE_KEYS_MAX or len(value) > _TUPLE_KEY_LENGTH_MAX:
                raise ValueError("too many keys that are tuples, or too long ones")
            return tuple(map(_plain_key, value))
        return _plain_key(value)


def _plain_key(value: Any) -> Any:
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, str | bytes | float) or value is None:
        return value
    if isinstance(value, int) and abs(value) < _WHOLE_HASH:
        return value
    raise ValueError(f"a {type(value).__name__} as a key")
