"""Pickles read without running anything that they ask for.

A pickle is a program that may call any function. This unpickler knows a short list of names: those that
numpy, joblib, torch and `collections` write for plain data. Each is replaced by a function of our own that
checks its arguments; every other name is refused. It imports neither torch nor joblib, and allocates no more
than the file holds.
"""

from __future__ import annotations

import collections
import io
import math
import pickle
import struct
from collections.abc import Callable
from typing import Any, ClassVar, NoReturn

import numpy as np
from numpy.typing import NDArray

from simrecon.errors import InputError
from simrecon.evidence import tensors
from simrecon.io.limits import MAX_BYTES, size_text

VALID = "numbers, text, lists, dictionaries, numpy arrays and torch tensors"
_KINDS = "biufcSUO"
_DAMAGED = (
    pickle.UnpicklingError, EOFError, ValueError, TypeError, KeyError, IndexError, AttributeError,
    OverflowError, MemoryError, RecursionError, UnicodeDecodeError, NotImplementedError, struct.error,
)  # fmt: skip


def loads_legacy(source: str, content: bytes) -> Any:
    """The plain data in a file of torch's layout before 1.6; see `loads`."""
    try:
        return tensors.legacy(content, lambda part, storages: Unpickler(source, part, storages).load())
    except _DAMAGED as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{source}: found a damaged torch file ({reason}); valid: a whole file") from error


def loads(source: str, content: bytes, storage: tensors.Storages | None = None) -> Any:
    """The plain data in a pickle.

    Args:
        source: name of the file, for messages.
        content: the pickle, decompressed; joblib's arrays within it too.
        storage: gives the bytes of tensors by key, for torch's files.

    Raises:
        InputError: damaged, or it asks for a name that is not on the list, which the message gives.
    """
    stream = io.BytesIO(content)
    try:
        return Unpickler(source, stream, storage).load()
    except InputError:
        raise
    except _DAMAGED as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{source}: found a damaged pickle ({reason}); valid: a whole file") from error


class _Plain(np.ndarray[Any, Any]):
    """An array that a pickle fills; what it is filled with is checked first."""

    def __setstate__(self, state: Any) -> None:
        _version, shape, dtype, fortran, data = state
        kind = _dtype_of(dtype)
        count = _count(shape)
        if kind.hasobject:
            if not isinstance(data, list) or len(data) != count:
                raise ValueError(f"an array of shape {shape} of {len(data)} objects")
        elif isinstance(data, str):
            data = data.encode("latin-1")
        if not kind.hasobject and len(data) != count * kind.itemsize:
            raise ValueError(f"an array of shape {shape} and {kind} in {len(data)} bytes")
        super().__setstate__((1, tuple(shape), kind, bool(fortran), data))  # type: ignore[arg-type]


class _Dtype:
    """The type of an array's elements: one of numpy's plain ones."""

    def __init__(self, spec: Any, _align: Any = False, _copy: Any = True) -> None:
        if isinstance(spec, bytes):
            spec = spec.decode("ascii")
        if not isinstance(spec, str) or len(spec) > 12 or spec.lstrip("<>=|")[:1] not in _KINDS:
            raise ValueError(f"elements of type {spec!r}")
        self.value: np.dtype[Any] = np.dtype(spec)

    def __setstate__(self, state: Any) -> None:
        order, subtype, names = state[1], state[2], state[3]
        if subtype is not None or names is not None:
            raise ValueError("elements with fields")
        if order in ("<", ">"):
            self.value = self.value.newbyteorder(order)


class _Name:
    """Stands for a class that is named in a pickle but never called."""

    def __init__(self, name: str) -> None:
        self.name = name


class _JoblibArray:
    """What joblib writes before an array's bytes."""

    subclass: Any = None
    shape: Any = ()
    order: Any = "C"
    dtype: Any = None
    allow_mmap: Any = False
    numpy_array_alignment_bytes: Any = None

    def __setstate__(self, state: Any) -> None:
        for key, value in dict(state).items():
            if key in ("subclass", "shape", "order", "dtype", "allow_mmap", "numpy_array_alignment_bytes"):
                setattr(self, key, value)


def _dtype_of(dtype: Any) -> np.dtype[Any]:
    if isinstance(dtype, _Dtype):
        return dtype.value
    raise ValueError("an array without a type")


def _count(shape: Any) -> int:
    if not isinstance(shape, tuple) or len(shape) > 32 or any(type(n) is not int or n < 0 for n in shape):
        raise ValueError(f"an array of shape {shape!r}")
    return math.prod(shape)


def _reconstruct(_subtype: Any, _shape: Any, _typecode: Any) -> _Plain:
    return _Plain.__new__(_Plain, (0,))


def _scalar(dtype: Any, data: Any = b"") -> Any:
    kind = _dtype_of(dtype)
    if isinstance(data, str):
        data = data.encode("latin-1")
    if kind.hasobject or len(data) != kind.itemsize:
        raise ValueError(f"a number of type {kind} in {len(data)} bytes")
    return np.frombuffer(data, kind)[0]


def _from_buffer(data: Any, dtype: Any, shape: Any, order: Any) -> NDArray[Any]:
    """numpy.core.numeric._frombuffer of pickle protocol 5."""
    kind = _dtype_of(dtype)
    if kind.hasobject or len(data) != _count(shape) * kind.itemsize:
        raise ValueError(f"an array of shape {shape} and {kind} in {len(data)} bytes")
    return np.frombuffer(data, kind).reshape(shape, order="F" if order == "F" else "C")


def _encode(text: Any, encoding: Any = "latin1") -> bytes:
    """How protocol 2 writes bytes."""
    if encoding not in ("latin1", "latin-1") or not isinstance(text, str):
        raise ValueError(f"text in {encoding!r}")
    return text.encode("latin-1")


def _empty(kind: type[Any]) -> Callable[..., Any]:
    def make(*given: Any) -> Any:
        if given:
            raise ValueError(f"a {kind.__name__} made of other data")
        return kind()

    return make


def _default_dict(*_factory: Any) -> dict[Any, Any]:
    """A defaultdict as a plain dictionary: a missing key is an error here."""
    return {}


def _allowed() -> dict[str, Any]:
    names: dict[str, Any] = {
        "collections.OrderedDict": _empty(collections.OrderedDict),
        "collections.defaultdict": _default_dict,
        "_codecs.encode": _encode,
        "numpy.ndarray": _Name("numpy.ndarray"),
        "numpy.dtype": _Dtype,
        "joblib.numpy_pickle.NumpyArrayWrapper": _JoblibArray,
    }
    for module in ("builtins", "__builtin__"):
        names |= {f"{module}.{kind.__name__}": _empty(kind) for kind in (dict, list, bytes, int, float)}
    for core in ("core", "_core"):
        names[f"numpy.{core}.multiarray._reconstruct"] = _reconstruct
        names[f"numpy.{core}.multiarray.scalar"] = _scalar
        names[f"numpy.{core}.numeric._frombuffer"] = _from_buffer
    return names | tensors.NAMES


_ALLOWED = _allowed()


class Unpickler(pickle._Unpickler):
    """Reads plain data; see the module."""

    def __init__(self, source: str, stream: io.BytesIO, storage: tensors.Storages | None = None) -> None:
        super().__init__(stream, encoding="latin1")
        self._source, self._stream, self._storages = source, stream, storage
        self._made = 0

    def find_class(self, module: str, name: str) -> Any:
        """The stand-in of an allowed name.

        Raises:
            InputError: any other name.
        """
        if f"{module}.{name}" == "torch.storage._load_from_bytes":
            return self._nested
        found = _ALLOWED.get(f"{module}.{name}")
        if found is None:
            self._refuse(f"{module}.{name}"[:200])
        return found

    def _refuse(self, what: str) -> NoReturn:
        message = f"{self._source}: found {what!r} in the pickle, which is not run; valid: {VALID}"
        raise InputError(message)

    def get_extension(self, code: int) -> None:
        """Names registered by number are refused."""
        self._refuse(f"extension {code}")

    def persistent_load(self, pid: Any) -> Any:
        """A tensor's storage."""
        if self._storages is None:
            raise ValueError("a persistent id outside of torch's files")
        return self._storages.get(pid)

    def _nested(self, content: Any) -> Any:
        """A tensor's storage within a plain pickle: a file of torch's old layout, in bytes."""
        if not isinstance(content, bytes):
            raise ValueError("a storage that is no bytes")
        self._count_made(len(content))
        return tensors.legacy(content, lambda part, storages: self._part(part, storages))

    def _part(self, stream: io.BytesIO, storages: tensors.Storages | None) -> Any:
        return Unpickler(self._source, stream, storages).load()

    def _load_bytearray(self) -> None:
        (count,) = struct.unpack("<Q", self.read(8))  # type: ignore[attr-defined]
        if count > MAX_BYTES:
            raise ValueError(f"{size_text(count)} of bytes")
        data = self.read(count)  # type: ignore[attr-defined]
        if len(data) != count:
            raise EOFError("it ends too early")
        self.append(bytearray(data))  # type: ignore[attr-defined]

    def _count_made(self, size: int) -> None:
        """What a small pickle makes of itself over and over must end somewhere."""
        self._made += size
        if self._made > MAX_BYTES:
            raise ValueError(f"it makes more than {size_text(MAX_BYTES)}")

    def _load_reduce(self) -> None:
        super().load_reduce()  # type: ignore[misc]
        made = self.stack[-1]  # type: ignore[attr-defined]
        if isinstance(made, bytes):
            self._count_made(len(made))

    def _load_build(self) -> None:
        """Fill an object of ours; nothing else has a state, least of all a function."""
        state = self.stack.pop()  # type: ignore[attr-defined]
        target = self.stack[-1]  # type: ignore[attr-defined]
        if isinstance(target, collections.OrderedDict):
            return  # torch's notes on a module
        if not isinstance(target, (_Plain, _Dtype, _JoblibArray)):
            raise ValueError(f"a state for a {type(target).__name__}")
        target.__setstate__(state)
        if isinstance(target, _Plain):
            self._count_made(target.nbytes)
        if isinstance(target, _JoblibArray):
            self.stack[-1] = self._joblib_array(target)  # type: ignore[attr-defined]

    def _joblib_array(self, wrapper: _JoblibArray) -> NDArray[Any]:
        """The array behind joblib's wrapper: padding and its bytes in the stream, or a pickle of objects."""
        kind, count = _dtype_of(wrapper.dtype), _count(wrapper.shape)
        if kind.hasobject:
            found = self._part(self._stream, None)
            if not isinstance(found, np.ndarray):
                raise ValueError("objects that are no array")
            return found
        if wrapper.numpy_array_alignment_bytes is not None:
            padding = self._stream.read(1)
            self._stream.seek(padding[0] if padding else 0, io.SEEK_CUR)
        wanted, there = count * kind.itemsize, len(self._stream.getbuffer()) - self._stream.tell()
        if wanted > there:
            raise EOFError(f"an array of {size_text(wanted)} in {size_text(max(there, 0))}")
        values = np.frombuffer(self._stream.read(wanted), kind)
        return values.reshape(wrapper.shape, order="F" if wrapper.order == "F" else "C")

    dispatch: ClassVar[dict[int, Any]] = {
        **pickle._Unpickler.dispatch,
        pickle.REDUCE[0]: _load_reduce,
        pickle.BUILD[0]: _load_build,
        pickle.BYTEARRAY8[0]: _load_bytearray,
    }
