"""What stands for numpy's arrays and types while a pickle fills them, and for those who hold arrays.

An array is made only when all of it is there, from bytes or a list whose size was checked: no memory is ever
shown that was not filled, and no type or pointer is taken over as it is.
"""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simrecon.io.npz import check_text

_TYPE = re.compile(r"[<>=|]?[biufcSUO][0-9]{0,9}")


class Shell:
    """An object that a pickle names first and fills later.

    Attributes:
        noun: what it is, for messages.
        value: what it is in the end; None until it is filled.
    """

    noun = "an object"
    value: Any = None

    def fill(self, state: Any) -> None:
        """Take over a state, checked.

        Raises:
            ValueError: it doesn't fit.
        """
        raise NotImplementedError


class Dtype(Shell):
    """The type of an array's elements: one of numpy's plain ones, or objects."""

    noun = "a type"

    def __init__(self, spec: Any, _align: Any = False, _copy: Any = True) -> None:
        word = spec.decode("ascii") if isinstance(spec, bytes) else spec
        if not isinstance(word, str) or not _TYPE.fullmatch(word):
            raise ValueError(f"elements of type {brief(word)}")
        self.dtype: np.dtype[Any] = np.dtype(word)

    def fill(self, state: Any) -> None:
        """Byte order; fields and the like are refused."""
        if not isinstance(state, tuple) or len(state) < 5:
            raise ValueError("a type without a state")
        order, subtype, names = state[1], state[2], state[3]
        if subtype is not None or names is not None:
            raise ValueError("elements with fields")
        if order in ("<", ">"):
            self.dtype = self.dtype.newbyteorder(order)


class ArrayShell(Shell):
    """numpy's `_reconstruct`: an array that is filled by a state of version, shape, type, order and data."""

    noun = "an array"

    def fill(self, state: Any) -> None:
        """Make the array."""
        if not isinstance(state, tuple) or len(state) != 5:
            raise ValueError("an array without a state")
        _version, shape, dtype, fortran, data = state
        kind = dtype_of(dtype)
        if kind.hasobject:
            self.value = _of_objects(data, shape)
        else:
            self.value = from_bytes(data, kind, shape, "F" if isinstance(fortran, int) and fortran else "C")


class Wrapper(Shell):
    """What joblib writes before an array's bytes; the machine reads these."""

    noun = "an array"
    shape: Any = ()
    order = "C"
    dtype: Any = None
    padded = False

    def fill(self, state: Any) -> None:
        """Take over shape, order and type."""
        if not isinstance(state, dict):
            raise ValueError("an array without a state")
        self.shape, self.dtype = state.get("shape", ()), dtype_of(state.get("dtype"))
        self.order = "F" if state.get("order") == "F" else "C"
        self.padded = state.get("numpy_array_alignment_bytes") is not None


class Held(Shell):
    """An object that holds arrays: all of its state, nothing that could run."""

    def __init__(self, *_arguments: Any) -> None:
        self.state: dict[str, Any] = {}

    def fill(self, state: Any) -> None:
        """Take over a dictionary."""
        if isinstance(state, dict):
            self.state = state


class Sparse(Held):
    """A matrix of scipy, by columns."""


class SparseRows(Sparse):
    """A matrix of scipy, by rows."""


class Variable(Held):
    """A variable of chumpy, `x` of its state."""


def brief(value: Any) -> str:
    """A value for a message; of one that holds others only its type, for they may have no end."""
    return f"{value!r:.40}" if isinstance(value, str | bytes | int | float) else f"a {type(value).__name__}"


def dtype_of(dtype: Any) -> np.dtype[Any]:
    """The type that a stand-in of `numpy.dtype` has come to."""
    if not isinstance(dtype, Dtype):
        raise ValueError("an array without a type")
    return dtype.dtype


def count_of(shape: Any) -> int:
    """How many elements a shape has, checked to be one."""
    if not isinstance(shape, tuple) or len(shape) > 32 or any(type(n) is not int for n in shape):
        raise ValueError(f"an array whose shape is {brief(shape)}")
    if min(shape, default=0) < 0:
        raise ValueError(f"an array of shape {shape}")
    return math.prod(shape)


def from_bytes(data: Any, kind: np.dtype[Any], shape: Any, order: Any) -> NDArray[Any]:
    """An array out of just as many bytes as it needs; Python 2 has them as text."""
    count = count_of(shape)
    if isinstance(data, str):
        data = data.encode("latin-1")
    if not isinstance(data, bytes | bytearray):
        raise ValueError(f"an array out of a {type(data).__name__}")
    if kind.hasobject or len(data) != count * kind.itemsize:
        raise ValueError(f"an array of shape {shape} and {kind} in {len(data)} bytes")
    if not count:
        return np.zeros(shape, kind)
    if not kind.itemsize:
        raise ValueError("elements of no size")
    values = np.frombuffer(bytes(data) if isinstance(data, bytearray) else data, kind)
    check_text(values)
    return values.reshape(shape, order="F" if order == "F" else "C")


def _of_objects(data: Any, shape: Any) -> NDArray[Any]:
    """An array of objects, which numpy lists in the order of C whatever the array's own."""
    count = count_of(shape)
    if not isinstance(data, list) or len(data) != count:
        raise ValueError(f"an array of shape {shape} of other than {count} objects")
    values = np.empty(count, object)
    for i, entry in enumerate(data):
        values[i] = entry
    return values.reshape(shape)


def scalar(dtype: Any, data: Any = b"") -> Any:
    """Numpy's `scalar`: one number or text."""
    kind = dtype_of(dtype)
    if not kind.itemsize and not len(data):
        return kind.type()
    return from_bytes(data, kind, (1,), "C")[0]


def from_buffer(data: Any, dtype: Any, shape: Any, order: Any, axes: Any = None) -> NDArray[Any]:
    """Numpy's `_frombuffer` of pickle protocol 5; order K keeps the axes in that of the memory."""
    values = from_bytes(data, dtype_of(dtype), shape, order)
    if order == "K" and axes is not None:
        if not isinstance(axes, tuple) or any(type(axis) is not int for axis in axes):
            raise ValueError(f"axes in the order of {brief(axes)}")
        return values.transpose(axes)
    return values
