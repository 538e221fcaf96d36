"""Archives of numpy's arrays, read without unpickling anything and without trusting what they claim."""

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
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simrecon.errors import InputError
from simrecon.io.arrays import Arrays, listed
from simrecon.io.limits import allowed, size_text
from simrecon.io.reading import read_bytes

MEMBERS_MAX = 10_000
"""Of an archive: each takes a tenth of a millisecond, and its name may be all that there is of it."""

# What numpy and zipfile raise on damaged archives.
_UNREADABLE = (
    ValueError, TypeError, EOFError, KeyError, OSError, MemoryError, OverflowError, NotImplementedError,
    RuntimeError, SyntaxError, struct.error, tokenize.TokenError, zlib.error, zipfile.BadZipFile,
)  # fmt: skip


def load(path: str | os.PathLike[str]) -> Arrays:
    """Read all arrays of an `.npz` without unpickling anything.

    Args:
        path: the file.

    Raises:
        InputError: no such file, not an `.npz`, damaged, or an array of Python objects.
    """
    source = os.fspath(path)
    try:
        content = read_bytes(path)
    except OSError as error:
        raise InputError(
            f"{source}: cannot be read ({error.strerror}); give an existing .npz file"
        ) from error
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
            if total > (most := allowed(len(content))):
                raise ValueError(f"{size_text(total)}; at most {size_text(most)} are read")
            if (count := len(archive.infolist())) > MEMBERS_MAX:
                raise ValueError(f"{count} arrays; at most {MEMBERS_MAX} are read")
            for info in archive.infolist():
                key = info.filename.removesuffix(".npy")
                arrays[key] = _member(source, key, archive, info, objects)
    except _UNREADABLE as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        message = f"found damage or Python objects ({reason})"
        raise InputError(f"{source}: {listed([key])}: {message}; valid: plain numpy arrays") from error
    return Arrays(source, arrays, hashlib.sha256(content).hexdigest())


def _member(
    source: str,
    key: str,
    archive: zipfile.ZipFile,
    info: zipfile.ZipInfo,
    objects: Callable[[str, str, bytes], NDArray[Any]] | None,
) -> NDArray[Any]:
    """One array of an archive, when its header claims what is there."""
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
