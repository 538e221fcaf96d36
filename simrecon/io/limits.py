"""How much of a foreign file is read into memory, and decompression that stops there."""

from __future__ import annotations

import bz2
import lzma
import zlib
from typing import Protocol

from simrecon.errors import InputError

MAX_BYTES = 2 << 30
"""Largest file, largest decompressed content and largest array that a reader takes."""

_FIXED_BYTES, _PER_BYTE = 256 << 20, 100
NUMBER_MAX = 1e12
"""No coordinate, angle, time or confidence of a file is larger, in any unit."""

_ZLIB, _GZIP, _BZIP2, _XZ, _LZMA = b"x", b"\x1f\x8b", b"BZh", b"\xfd7zXZ\x00", b"]\x00\x00"
_UNSUPPORTED = {b"\x04\x22\x4d\x18": "lz4", b"\x28\xb5\x2f\xfd": "zstandard"}
_STEP = 1 << 20


class _Decompressor(Protocol):
    @property
    def eof(self) -> bool: ...
    def decompress(self, data: bytes, /, max_length: int) -> bytes: ...


MISFITS = (
    TypeError, ValueError, LookupError, AttributeError, ArithmeticError, RecursionError, MemoryError,
)  # fmt: skip
"""What a reader ends in if a value deep in a file is of a kind that nobody thought of."""


def allowed(size: int) -> int:
    """Bytes that a file of this size may become: 256 MB, and 100 for each of its own, at most `MAX_BYTES`.

    Compressed landmarks become 2 to 20 bytes for each.
    """
    return min(_FIXED_BYTES + _PER_BYTE * size, MAX_BYTES)


def size_text(count: float) -> str:
    """A number of bytes for a message."""
    for unit in ("bytes", "kB", "MB"):
        if count < 1000:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.3g} GB"


def decompressed(source: str, content: bytes) -> bytes:
    """Content without its zlib, gzip, bzip2, xz or lzma compression; other content as it is.

    Args:
        source: name of the file, for messages.
        content: of the file.

    Raises:
        InputError: damaged, compressed by other means, or more than `allowed` when decompressed.
    """
    for magic, name in _UNSUPPORTED.items():
        if content.startswith(magic):
            message = f"{source}: found {name} compression; valid: none, zlib, gzip, bzip2, xz or lzma"
            raise InputError(message)
    method = _method(content)
    if method is None:
        return content
    try:
        return _inflate(source, method, content)
    except (zlib.error, OSError, lzma.LZMAError, EOFError, ValueError) as error:
        raise InputError(
            f"{source}: found damaged compressed content ({error}); valid: a whole file"
        ) from error


def _method(content: bytes) -> _Decompressor | None:
    if content.startswith(_ZLIB) and len(content) > 1 and int.from_bytes(content[:2], "big") % 31 == 0:
        return _Zlib(zlib.MAX_WBITS)
    if content.startswith(_GZIP):
        return _Zlib(zlib.MAX_WBITS | 16)
    if content.startswith(_BZIP2):
        return bz2.BZ2Decompressor()
    if content.startswith((_XZ, _LZMA)):
        return lzma.LZMADecompressor(memlimit=1 << 28)
    return None


class _Zlib:
    """zlib's decompressor with the interface of the other two."""

    def __init__(self, wbits: int) -> None:
        self._inner = zlib.decompressobj(wbits)

    @property
    def eof(self) -> bool:
        return self._inner.eof

    def decompress(self, data: bytes, /, max_length: int) -> bytes:
        return self._inner.decompress(self._inner.unconsumed_tail + data, max_length)


def _inflate(source: str, method: _Decompressor, content: bytes) -> bytes:
    parts: list[bytes] = []
    total, at, most = 0, 0, allowed(len(content))
    while not method.eof:
        compressed = content[at : at + _STEP]
        at += len(compressed)
        part = method.decompress(compressed, max_length=_STEP * 16)
        if not part and not compressed:
            raise EOFError("it ends too early")
        total += len(part)
        if total > most:
            limit = size_text(most)
            raise InputError(f"{source}: found more than {limit} when decompressed; valid: at most {limit}")
        parts.append(part)
    return b"".join(parts)
