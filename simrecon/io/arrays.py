"""The arrays of one `.npz` and the checks that every reader makes: one-line errors, nothing unpickled."""

from __future__ import annotations

import hashlib
import io
import math
import os
import struct
import sys
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from simrecon.errors import InputError
from simrecon.io.limits import MAX_BYTES, size_text
from simrecon.types import Array

_TOTAL_MAX_BYTES = 2 * MAX_BYTES
# What numpy and zipfile raise on damaged archives.
_UNREADABLE = (
    ValueError, TypeError, EOFError, KeyError, OSError, MemoryError, OverflowError, NotImplementedError,
    RuntimeError, SyntaxError, struct.error, tokenize.TokenError, zlib.error, zipfile.BadZipFile,
)  # fmt: skip


@dataclass(frozen=True)
class Arrays:
    """The arrays of one `.npz` and the checks that every reader makes; every failure is an `InputError`.

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
        given = self.array(key)
        wanted = [self._sizes.get(n, n) if isinstance(n, str) else n for n in shape]
        fits = given.ndim == len(shape) and all(
            isinstance(n, str) or n == m for n, m in zip(wanted, given.shape, strict=True)
        )
        if not fits or given.size == 0:
            known = [f"{n} = {m}" for n, m in zip(shape, wanted, strict=True) if n != m]
            self.fail(key, f"shape {given.shape}", ", ".join([f"shape {_tuple(shape)}, not empty", *known]))
        if given.dtype.kind not in "fiu":
            self.fail(key, f"values of type {given.dtype}", "real numbers")
        self._sizes.update({n: m for n, m in zip(shape, given.shape, strict=True) if isinstance(n, str)})
        values: Array = given.astype(np.float64)
        if np.isinf(values).any():
            self.fail(key, "infinite values", "finite numbers, or NaN where the format allows it")
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
        given = self.array(key)
        if given.ndim != 0 or given.dtype.kind != "U" or str(given) not in valid:
            found = repr(str(given)) if given.ndim == 0 and given.dtype.kind == "U" else _described(given)
            self.fail(key, found, " or ".join(repr(v) for v in valid))
        return str(given)

    def names(self, key: str, size: str) -> tuple[str, ...]:
        """A list of different strings; its length is the size that the letter stands for."""
        given = self.array(key)
        if given.ndim != 1 or given.dtype.kind != "U" or given.size == 0:
            self.fail(key, _described(given), f"a list of strings ({size},), not empty")
        names = tuple(str(n) for n in given)
        if twice := sorted({n for n in names if names.count(n) > 1}):
            self.fail(key, f"more than once: {listed(twice)}", "each name once")
        self._sizes[size] = len(names)
        return names


def load(path: str | os.PathLike[str]) -> Arrays:
    """Read all arrays of an `.npz` without unpickling anything.

    Args:
        path: the file.

    Raises:
        InputError: no such file, not an `.npz`, damaged, or an array of Python objects.
    """
    source = os.fspath(path)
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"{source}: can't be read ({error.strerror}); give an existing .npz file") from error
    return parse_npz(source, content)


def parse_npz(
    source: str, content: bytes, objects: Callable[[str, str, bytes], NDArray[Any]] | None = None
) -> Arrays:
    """All arrays in the bytes of an `.npz`; nothing is allocated that the file does not hold.

    Args:
        source: name of the file, for messages.
        content: its bytes.
        objects: reads a member that holds Python objects, of source, key and bytes; None: such a member is
            an error.

    Raises:
        InputError: not an `.npz`, damaged, or an array of Python objects.
    """
    if not content.startswith(b"PK\x03\x04"):
        raise InputError(f"{source}: found a file that is no .npz archive; valid: an .npz of numpy arrays")
    arrays: dict[str, NDArray[Any]] = {}
    key = "archive"
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            total = sum(info.file_size for info in archive.infolist())
            if total > _TOTAL_MAX_BYTES:
                raise ValueError(f"{size_text(total)}; at most {size_text(_TOTAL_MAX_BYTES)} are read")
            for info in archive.infolist():
                key = info.filename.removesuffix(".npy")
                arrays[key] = _member(source, key, archive, info, objects)
    except _UNREADABLE as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        found = f"found damage or Python objects ({reason})"
        raise InputError(f"{source}: {listed([key])}: {found}; valid: plain numpy arrays") from error
    return Arrays(source, arrays, hashlib.sha256(content).hexdigest())


def _member(
    source: str,
    key: str,
    archive: zipfile.ZipFile,
    info: zipfile.ZipInfo,
    objects: Callable[[str, str, bytes], NDArray[Any]] | None,
) -> NDArray[Any]:
    """One array of an archive, when its header claims what is there."""
    if info.file_size > MAX_BYTES:
        raise ValueError(f"{size_text(info.file_size)}; at most {size_text(MAX_BYTES)} are read")
    with archive.open(info) as part:
        raw = part.read()
    stream = io.BytesIO(raw)
    version = np.lib.format.read_magic(stream)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = read(stream)
    if dtype.hasobject and objects is not None:
        return objects(source, key, raw)
    claimed, there = math.prod(shape) * dtype.itemsize, len(raw) - stream.tell()
    if claimed > there and not dtype.hasobject:
        raise ValueError(f"an array of {size_text(claimed)} in {size_text(there)}")
    values: NDArray[Any] = np.lib.format.read_array(io.BytesIO(raw), allow_pickle=False)
    check_text(values)
    return values


def check_text(values: NDArray[Any]) -> None:
    """Check the characters of text: numpy takes any number for one, and fails when it is looked at.

    Raises:
        ValueError: there is no such character.
    """
    if values.dtype.kind == "U" and values.size and values.itemsize:
        codes = np.ascontiguousarray(values).reshape(-1).view(values.dtype.byteorder + "u4")
        if codes.max() > sys.maxunicode:
            raise ValueError(f"text with a character of number {codes.max()}")


def listed(names: Collection[str]) -> str:
    """Names for a message, those that are no plain word in quotes."""
    return ", ".join(name if name.isidentifier() else repr(name) for name in map(str, names))


def _tuple(shape: tuple[int | str, ...]) -> str:
    return f"({', '.join(map(str, shape))}{',' if len(shape) == 1 else ''})"


def _described(array: NDArray[Any]) -> str:
    return f"shape {array.shape} of type {array.dtype}"
