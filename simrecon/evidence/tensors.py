"""Tensors of torch's files, as numpy arrays, without torch."""

from __future__ import annotations

import io
import math
import struct
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simrecon.errors import InputError
from simrecon.io.limits import MAX_BYTES, size_text

# By the names of torch's storages; bfloat16 has no numpy type and is widened.
_TYPES = {
    "Double": "f8", "Float": "f4", "Half": "f2", "BFloat16": "bf2", "Long": "i8", "Int": "i4", "Short": "i2",
    "Char": "i1", "Byte": "u1", "Bool": "?", "Untyped": "u1",
}  # fmt: skip
_REPEATED_MAX_BYTES = 1 << 26
LEGACY_MAGIC = 0x1950A86A20F9469CFC6C


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

    def get(self, pid: Any) -> Storage:
        """The storage that a pickle's persistent id names: ("storage", type, key, device, count, …)."""
        kind, key, count = _checked(pid)
        known = self._known.get((key, kind.code))
        if known is None:
            known = Storage(elements(self._read(key), kind, count, self._order))
            self._known[key, kind.code] = known
        return known


def _checked(pid: Any) -> tuple[StorageType, str, int]:
    if not isinstance(pid, tuple) or len(pid) < 5 or pid[0] != "storage":
        raise ValueError(f"an id {pid!r:.80}")
    kind, key, count = pid[1], pid[2], pid[4]
    if not isinstance(kind, StorageType) or not isinstance(key, str) or type(count) is not int or count < 0:
        raise ValueError(f"a storage {key!r:.80}")
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
        raise ValueError(f"a tensor of shape {tuple(shape)}")
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
NAMES: dict[str, Any] = {
    **{f"torch.{name}": name for name in _DTYPES},
    "torch._utils._rebuild_tensor_v2": rebuild,
    "torch._utils._rebuild_tensor": rebuild,
    "torch._utils._rebuild_parameter": _parameter,
    "torch.Size": _size,
    "torch.device": _device,
    **{f"torch.{name}Storage": StorageType(code) for name, code in _TYPES.items()},
    "torch.storage.UntypedStorage": StorageType("u1"),
}


def archive_pickle(source: str, archive: zipfile.ZipFile) -> tuple[bytes, Storages]:
    """The pickle in a file of `torch.save`, and its storages.

    Raises:
        InputError: it is none, or a part of it is damaged or too large.
    """
    inside = {info.filename: info for info in archive.infolist()}
    main = next((name for name in inside if name.endswith("/data.pkl") or name == "data.pkl"), None)
    if main is None:
        raise InputError(f"{source}: found a zip archive without data.pkl; valid: a file of torch.save")
    root = main.removesuffix("data.pkl")
    order = member(source, archive, inside, f"{root}byteorder") if f"{root}byteorder" in inside else b"little"

    def read(key: str) -> bytes:
        return member(source, archive, inside, f"{root}data/{key}")

    return member(source, archive, inside, main), Storages(read, order.strip() == b"big")


def member(source: str, archive: zipfile.ZipFile, inside: Mapping[str, zipfile.ZipInfo], name: str) -> bytes:
    """One file of a zip archive, not more of it than `MAX_BYTES`.

    Raises:
        InputError: missing or too large.
    """
    if name not in inside:
        raise InputError(f"{source}: {name}: found no such part; valid: a whole file")
    info = inside[name]
    if info.file_size > MAX_BYTES:
        found, limit = size_text(info.file_size), size_text(MAX_BYTES)
        raise InputError(f"{source}: {name}: found {found}; valid: at most {limit}")
    with archive.open(info) as part:
        content = part.read(info.file_size + 1)
    if len(content) != info.file_size:
        raise InputError(
            f"{source}: {name}: found {len(content)} bytes of {info.file_size}; valid: a whole file"
        )
    return content


def legacy(content: bytes, load: Callable[[io.BytesIO, Storages | None], Any]) -> Any:
    """What torch's old layout holds: four pickles, a list of keys, then count and bytes of each storage.

    The storages come after the pickle that names them, so it is read twice.

    Args:
        content: of the file.
        load: reads one pickle from a stream.
    """
    stream = io.BytesIO(content)
    magic, _protocol, _system = (load(stream, None) for _ in range(3))
    if magic != LEGACY_MAGIC:
        raise ValueError("tensors in a layout that is not torch's")
    start = stream.tell()
    named = _Named()
    load(stream, named)
    keys = load(stream, None)
    parts: dict[str, bytes] = {}
    for key in keys:
        (count,) = struct.unpack("<q", stream.read(8))
        parts[key] = stream.read(max(count, 0) * named.sizes.get(key, 1))
    return load(io.BytesIO(content[start:]), Storages(lambda key: parts[key]))


class _Named(Storages):
    """Notes which storages a pickle names, without their elements."""

    def __init__(self) -> None:
        super().__init__(lambda _key: b"")
        self.sizes: dict[str, int] = {}

    def get(self, pid: Any) -> Storage:
        kind, key, _count = _checked(pid)
        self.sizes[key] = np.dtype("u2" if kind.code == "bf2" else kind.code).itemsize
        return Storage(None)
