"""Nested dictionaries, lists, numbers, text and arrays out of the bytes of a container."""

from __future__ import annotations

import functools
import io
import json
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simrecon.errors import InputError
from simrecon.io import pickles
from simrecon.io.arrays import listed
from simrecon.io.limits import allowed, decompressed, size_text
from simrecon.io.npz import parse_npz
from simrecon.io.pickles import torch_files

_DAMAGED = (
    zipfile.BadZipFile, zlib.error, EOFError, OSError, ValueError, RuntimeError, NotImplementedError,
)  # fmt: skip


def _npz(source: str, raw: bytes) -> dict[str, Any]:
    return dict(parse_npz(source, raw, objects=_object_array).content)


def _object_array(source: str, key: str, raw: bytes) -> NDArray[Any]:
    return npy(f"{source}: {listed([key])}", raw)


def npy(source: str, raw: bytes) -> NDArray[Any]:
    """The array of an `.npy`; Python objects in it are read by our own unpickler.

    Args:
        source: name of the file, for messages.
        raw: its bytes.

    Raises:
        InputError: damaged, or something in it that is not plain data.
    """
    stream = io.BytesIO(raw)
    try:
        version = np.lib.format.read_magic(stream)
        read = (
            np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        )
        shape, fortran, dtype = read(stream)
    except (ValueError, EOFError, struct.error, SyntaxError, TypeError, tokenize.TokenError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"{source}: found a damaged header ({reason}); valid: a whole .npy file") from error
    there = len(raw) - stream.tell()
    if dtype.hasobject:
        values = pickles.loads(source, raw[stream.tell() :])
        if not isinstance(values, np.ndarray):
            raise InputError(f"{source}: found objects that are no array; valid: a whole .npy file")
        return values
    count = functools.reduce(lambda a, b: a * b, shape, 1)
    if count * dtype.itemsize != there:
        found_text = f"{size_text(there)} for an array of {size_text(count * dtype.itemsize)}"
        raise InputError(f"{source}: found {found_text}; valid: a whole .npy file")
    plain: NDArray[Any] = np.frombuffer(raw, dtype, count, stream.tell())
    return plain.reshape(shape, order="F" if fortran else "C")


def _npy(source: str, raw: bytes) -> Any:
    """The array; or what `np.save` of a dictionary holds: an array of no axes with one object."""
    array = npy(source, raw)
    return array.item() if array.dtype.hasobject and array.ndim == 0 else array


def _torch(source: str, raw: bytes) -> Any:
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            total = sum(info.file_size for info in archive.infolist())
            if total > (most := allowed(len(raw))):
                raise ValueError(f"{size_text(total)}; at most {size_text(most)} are read")
            raw, storages = torch_files.archive_pickle(source, archive)
            return pickles.loads(source, raw, storages)
    except _DAMAGED as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{source}: found a damaged archive ({reason}); valid: a whole file") from error


def of_json(source: str, text: str) -> Any:
    """The tree of a JSON file; of one value a line, their list.

    Args:
        source: name of the file, for messages.
        text: of it.

    Raises:
        InputError: damaged.
    """
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        if (lines := _lines(text)) is not None:
            return lines
        reason = " ".join(str(error).split())
        raise InputError(f"{source}: found damaged JSON ({reason}); valid: a whole file") from error


def _lines(text: str) -> list[Any] | None:
    """The values of JSON with one on each line; None if that is not what it is."""
    lines = [line for line in text.split("\n") if line.strip()]
    if len(lines) < 2 or not all(line.lstrip()[0] in "{[" for line in lines):
        return None
    try:
        return [json.loads(line) for line in lines]
    except (ValueError, RecursionError):
        return None


def _pickle(source: str, raw: bytes) -> Any:
    raw = decompressed(source, raw)
    tree = pickles.loads(source, raw)
    return pickles.loads_legacy(source, raw) if torch_files.is_legacy(tree) else tree


BINARY: dict[str, Callable[[str, bytes], Any]] = {
    "npz": _npz,
    "npy": _npy,
    "torch": _torch,
    "pickle": _pickle,
}
"""What reads the bytes of a file, whose name is for messages, by kind of container."""
