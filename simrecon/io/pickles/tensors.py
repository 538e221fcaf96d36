"""Tensors of torch as numpy arrays, without torch."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simrecon.io.limits import MAX_BYTES, size_text
from simrecon.io.pickles.arrays import brief

# By the names of torch's storages; bfloat16 has no numpy type and is widened.
_TYPES = {
    "Double": "f8", "Float": "f4", "Half": "f2", "BFloat16": "bf2", "Long": "i8", "Int": "i4", "Short": "i2",
    "Char": "i1", "Byte": "u1", "Bool": "?", "Untyped": "u1",
}  # fmt: skip
_REPEATED_MAX_BYTES = 1 << 26


@dataclass(frozen=True)
class StorageType:
    """The type of a storage's elements."""

    code: str


@dataclass(frozen=True)
class Storage:
    """Elements of tensors, all of one type; None where they are not read yet."""

    values: NDArray[Any] | None


class Storages:
    """The storages of a file by key."""

    def __init__(self, read: Callable[[str], bytes], big_endian: bool = False) -> None:
        self._read, self._order = read, ">" if big_endian else "<"
        self._known: dict[tuple[str, str], Storage] = {}
        self._left = MAX_BYTES

    def get(self, pid: Any) -> Storage:
        """The storage that a pickle's persistent id names: ("storage", type, key, device, count, …)."""
        kind, key, count = _checked(pid)
        known = self._known.get((key, kind.code))
        if known is None:
            content = self._read(key)
            self._left -= len(content)
            if self._left < 0:
                raise ValueError(f"more than {size_text(MAX_BYTES)} of tensors")
            known = Storage(elements(content, kind, count, self._order))
            self._known[key, kind.code] = known
        return known


def _checked(pid: Any) -> tuple[StorageType, str, int]:
    if not isinstance(pid, tuple) or len(pid) < 5 or pid[0] != "storage":
        raise ValueError(f"an id that is {brief(pid)}")
    kind, key, count = getattr(pid[1], "value", None), pid[2], pid[4]
    if not isinstance(kind, StorageType) or not isinstance(key, str) or type(count) is not int or count < 0:
        raise ValueError(f"a storage that is {brief(key)}")
    return kind, key, count


def elements(content: bytes, kind: StorageType, count: int, order: str) -> NDArray[Any]:
    """The first `count` elements in the bytes of a storage, (count,)."""
    widened = kind.code == "bf2"
    plain = np.dtype(order + ("u2" if widened else kind.code))
    if count * plain.itemsize > len(content):
        raise EOFError(f"a tensor of {size_text(count * plain.itemsize)} in {size_text(len(content))}")
    values = np.frombuffer(content, plain, count)
    if widened:
        return (values.astype("u4") << 16).view("f4")
    return values


def rebuild(storage: Any, offset: Any, shape: Any, stride: Any, *_rest: Any) -> NDArray[Any]:
    """A tensor as a view of its storage, checked to lie within it."""
    if not isinstance(storage, Storage):
        raise ValueError("a tensor without a storage")
    numbers = [offset, *shape, *stride]
    if len(shape) != len(stride) or len(shape) > 32 or any(type(n) is not int or n < 0 for n in numbers):
        raise ValueError(f"a tensor whose shape is {brief(shape)}")
    values = storage.values
    if values is None:
        return np.empty(0)
    count = math.prod(shape)
    last = offset + sum((n - 1) * step for n, step in zip(shape, stride, strict=True)) if count else 0
    if last >= max(len(values), 1) or (count and not len(values)):
        raise ValueError(f"a tensor of shape {tuple(shape)} in {len(values)} elements")
    if count > len(values) and count * values.itemsize > _REPEATED_MAX_BYTES:
        raise ValueError(f"a tensor of {size_text(count * values.itemsize)}")
    steps = [step * values.itemsize for step in stride]
    return np.lib.stride_tricks.as_strided(values[offset:], tuple(shape), steps, writeable=False)


def _parameter(tensor: Any, *_rest: Any) -> Any:
    return tensor


def _size(shape: Any = ()) -> tuple[int, ...]:
    if len(shape) > 32:
        raise ValueError(f"a shape of {len(shape)} axes")
    return tuple(shape)


def _device(*_name: Any) -> None:
    """Where a tensor was: of no use here."""


_DTYPES = ("float64", "float32", "float16", "bfloat16", "int64", "int32", "int16", "int8", "uint8", "bool")
MAKERS: dict[str, Any] = {
    "torch._utils._rebuild_tensor_v2": rebuild,
    "torch._utils._rebuild_tensor": rebuild,
    "torch._utils._rebuild_parameter": _parameter,
    "torch.Size": _size,
    "torch.device": _device,
    **{f"torch.{name}": None for name in _DTYPES},
}
"""Functions that stand for torch's names; None: it is never called."""
TYPES: dict[str, StorageType] = {
    **{f"torch.{name}Storage": StorageType(code) for name, code in _TYPES.items()},
    "torch.storage.UntypedStorage": StorageType("u1"),
}


class Listed(Storages):
    """Notes which storages a pickle names, without their elements."""

    def __init__(self) -> None:
        super().__init__(lambda _key: b"")
        self.sizes: dict[str, int] = {}

    def get(self, pid: Any) -> Storage:
        """Note a storage and how large its elements are."""
        kind, key, _count = _checked(pid)
        self.sizes[key] = np.dtype("u2" if kind.code == "bf2" else kind.code).itemsize
        return Storage(None)
