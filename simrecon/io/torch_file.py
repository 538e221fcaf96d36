"""Tensors in the file that `torch.load` reads, written without torch: a zip of a pickle and raw numbers.

The pickle is that of `torch.save` since version 1.6: a dictionary by name of numbers, and of calls that build
a tensor on a storage, which the zip holds as `data/0`, `data/1`, …. It loads with `weights_only`.
"""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

STORAGES = {
    "float32": "FloatStorage",
    "float64": "DoubleStorage",
    "int64": "LongStorage",
    "bool": "BoolStorage",
}
_MARK, _TUPLE, _TRUE, _FALSE = b"(", b"t", b"\x88", b"\x89"
_EPOCH = (1980, 1, 1, 0, 0, 0)


def dumps(content: Mapping[str, NDArray[np.generic] | float | int]) -> bytes:
    """The content of a file; same values, same bytes.

    Args:
        content: arrays of float32, float64, int64 or bool, and numbers, by name.
    """
    storages: list[bytes] = []
    body = b"\x80\x02}" + _MARK
    for name, value in content.items():
        body += _text(name)
        if isinstance(value, np.ndarray):
            body += _tensor(value, len(storages))
            storages.append(np.ascontiguousarray(value).tobytes())
        else:
            body += _number(value)
    body += b"u."
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        files = {"data.pkl": body, "byteorder": b"little", "version": b"3\n"}
        files |= {f"data/{index}": raw for index, raw in enumerate(storages)}
        for name, raw in files.items():
            archive.writestr(zipfile.ZipInfo(f"archive/{name}", _EPOCH), raw)
    return buffer.getvalue()


def _tensor(array: NDArray[np.generic], index: int) -> bytes:
    """`torch._utils._rebuild_tensor_v2(storage, offset, size, stride, requires_grad, hooks)`."""
    strides = [step // array.itemsize for step in np.ascontiguousarray(array).strides]
    kind = STORAGES[array.dtype.name]
    storage = _MARK + _text("storage") + _name("torch", kind) + _text(str(index)) + _text("cpu")
    storage += _number(array.size) + _TUPLE + b"Q"
    hooks = _name("collections", "OrderedDict") + b")R"
    parts = storage + _number(0) + _sizes(array.shape) + _sizes(strides) + _FALSE + hooks
    return _name("torch._utils", "_rebuild_tensor_v2") + _MARK + parts + _TUPLE + b"R"


def _sizes(sizes: tuple[int, ...] | list[int]) -> bytes:
    return _MARK + b"".join(_number(size) for size in sizes) + _TUPLE


def _name(module: str, name: str) -> bytes:
    return f"c{module}\n{name}\n".encode("ascii")


def _text(word: str) -> bytes:
    raw = word.encode("utf-8")
    return b"X" + struct.pack("<I", len(raw)) + raw


def _number(value: float | int) -> bytes:
    if isinstance(value, bool):
        return _TRUE if value else _FALSE
    if isinstance(value, int):
        small = -(2**31) <= value < 2**31
        return b"J" + struct.pack("<i", value) if small else b"\x8a\x08" + struct.pack("<q", value)
    return b"G" + struct.pack(">d", value)
