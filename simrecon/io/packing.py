"""Arrays between two processes: a line of JSON that describes them, and their content."""

from __future__ import annotations

import json
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

_SIZE_BYTES = 8


def packed(arrays: dict[str, NDArray[Any]]) -> bytes:
    """Arrays of numbers and text as bytes."""
    plain = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    about = {name: [array.dtype.str, array.shape] for name, array in plain.items()}
    return b"".join([json.dumps(about).encode() + b"\n", *(array.tobytes() for array in plain.values())])


def unpacked(content: bytes) -> dict[str, NDArray[Any]]:
    """The arrays of `packed`, of bytes that may be anything.

    Raises:
        ValueError, KeyError, TypeError, EOFError: they are no packed arrays.
    """
    line, _, rest = content.partition(b"\n")
    arrays: dict[str, NDArray[Any]] = {}
    at = 0
    for name, (kind, shape) in json.loads(line).items():
        dtype = np.dtype(str(kind))
        if dtype.kind not in "fiuU" or not all(type(size) is int and size >= 0 for size in shape):
            raise ValueError("no plain array")
        count = int(np.prod(shape, dtype=object))
        size = count * dtype.itemsize
        arrays[name] = np.frombuffer(rest, dtype, count if size else 0, at).reshape(shape)
        at += size
    return arrays


def send(stream: IO[bytes] | None, arrays: dict[str, NDArray[Any]]) -> None:
    """Write arrays to a pipe.

    Raises:
        OSError: nobody reads it any more.
    """
    if stream is None:
        raise OSError("there is no pipe")
    content = packed(arrays)
    stream.write(len(content).to_bytes(_SIZE_BYTES, "little"))
    stream.write(content)
    stream.flush()


def receive(stream: IO[bytes] | None) -> dict[str, NDArray[Any]]:
    """The next arrays from a pipe.

    Raises:
        EOFError: it ended.
    """
    if stream is None:
        raise EOFError("there is no pipe")
    size = int.from_bytes(_exactly(stream, _SIZE_BYTES), "little")
    return unpacked(_exactly(stream, size))


def _exactly(stream: IO[bytes], size: int) -> bytes:
    content = stream.read(size)
    if len(content) < size:
        raise EOFError("the pipe ended")
    return content
