"""The focal length that a phone writes into an .mov or .mp4: QuickTime's metadata, `keys` and `ilst`."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

FOCAL_KEY = "com.apple.quicktime.camera.focal_length.35mm_equivalent"
FULL_FRAME_DIAGONAL_MM = math.hypot(36.0, 24.0)
FOCAL_RANGE_MM = (8.0, 800.0)
_CONTAINERS = (b"moov", b"trak", b"udta")
_META_MAX = 1 << 20
_DEPTH_MAX = 6
_FORMATS = {
    1: None, 21: None, 22: None, 23: ">f", 24: ">d",
    65: ">b", 66: ">h", 67: ">i", 74: ">q", 75: ">B", 76: ">H", 77: ">I", 78: ">Q",
}  # fmt: skip


def focal_35mm(path: Path) -> float | None:
    """The focal length with the same diagonal field of view on 36 mm × 24 mm; None if it is not there."""
    try:
        with path.open("rb") as file:
            file.seek(0, 2)
            for meta in _metas(file, 0, file.tell(), 0):
                value = _focal(meta)
                if value is not None and FOCAL_RANGE_MM[0] <= value <= FOCAL_RANGE_MM[1]:
                    return value
    except (OSError, struct.error, ValueError):
        return None
    return None


def focal_px(focal_mm: float, size_px: tuple[int, int]) -> float:
    """Focal length in pixels of a 35 mm equivalent; the image is taken as the sensor's whole diagonal."""
    return focal_mm / FULL_FRAME_DIAGONAL_MM * math.hypot(*size_px)


def _metas(file: BinaryIO, start: int, end: int, depth: int) -> Iterator[bytes]:
    """The content of every `meta` box in the movie, its tracks and its user data; only headers are read."""
    at = start
    while at + 8 <= end and depth <= _DEPTH_MAX:
        file.seek(at)
        size, kind = struct.unpack(">I4s", file.read(8))
        header = 8
        if size == 1:
            (size,) = struct.unpack(">Q", file.read(8))
            header = 16
        elif size == 0:
            size = end - at
        if size < header or at + size > end:
            return
        if kind in _CONTAINERS:
            yield from _metas(file, at + header, at + size, depth + 1)
        elif kind == b"meta" and size <= _META_MAX:
            yield file.read(size - header)
        at += size


def _boxes(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = 0
    while at + 8 <= len(content):
        size, kind = struct.unpack_from(">I4s", content, at)
        if size < 8 or at + size > len(content):
            return
        yield kind, content[at + 8 : at + size]
        at += size


def _focal(meta: bytes) -> float | None:
    # QuickTime's `meta` begins with its first box, that of ISO 14496-12 with four more bytes.
    parts = dict(_boxes(meta if meta[4:8] in (b"hdlr", b"keys") else meta[4:]))
    keys, items = parts.get(b"keys"), parts.get(b"ilst")
    if keys is None or items is None:
        return None
    names = [name.decode("utf-8", "replace") for _, name in _boxes(keys[8:])]
    if FOCAL_KEY not in names:
        return None
    number = names.index(FOCAL_KEY) + 1
    for kind, item in _boxes(items):
        if int.from_bytes(kind, "big") == number:
            return _value(dict(_boxes(item)).get(b"data", b""))
    return None


def _value(data: bytes) -> float | None:
    if len(data) < 9:
        return None
    (kind,) = struct.unpack_from(">I", data)
    raw = data[8:]
    if kind not in _FORMATS:
        return None
    form = _FORMATS[kind]
    if form is not None:
        return float(struct.unpack_from(form, raw)[0])
    return (
        float(raw.decode("ascii", "strict"))
        if kind == 1
        else float(int.from_bytes(raw, "big", signed=kind == 21))
    )
