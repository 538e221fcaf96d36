"""Files of `torch.save`: a zip archive today, four pickles and the elements before torch 1.6."""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Callable, Mapping
from typing import Any

from simrecon.errors import InputError
from simrecon.io.limits import MAX_BYTES, size_text
from simrecon.io.pickles.tensors import Listed, Storages

LEGACY_MAGIC = 0x1950A86A20F9469CFC6C
"""The first pickle of a file of the old layout."""


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


def is_legacy(first: Any) -> bool:
    """Whether the first pickle of a file says that it is of the old layout."""
    return isinstance(first, int) and first == LEGACY_MAGIC


def legacy(content: bytes, load: Callable[[io.BytesIO, Storages | None], Any]) -> Any:
    """What torch's old layout holds: four pickles, a list of keys, then count and bytes of each storage.

    The storages come after the pickle that names them, so it is read twice.

    Args:
        content: of the file.
        load: reads one pickle from a stream.
    """
    stream = io.BytesIO(content)
    magic, _protocol, _system = (load(stream, None) for _ in range(3))
    if not is_legacy(magic):
        raise ValueError("tensors in a layout that is not torch's")
    start = stream.tell()
    listed = Listed()
    load(stream, listed)
    keys = load(stream, None)
    if not isinstance(keys, list) or not all(isinstance(key, str) for key in keys):
        raise ValueError("storages without keys")
    parts: dict[str, bytes] = {}
    for key in keys:
        (count,) = struct.unpack("<q", stream.read(8))
        parts[key] = stream.read(max(count, 0) * listed.sizes.get(key, 1))
    return load(io.BytesIO(content[start:]), Storages(lambda key: parts[key]))
