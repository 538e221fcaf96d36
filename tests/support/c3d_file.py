"""C3D files of any processor, written byte by byte."""

from __future__ import annotations

import struct

import numpy as np

PROCESSORS = {"intel": 84, "dec": 85, "mips": 86}


def c3d(
    labels: list[str],
    places: np.ndarray,
    *,
    unit: str = "mm",
    rate_hz: float = 100.0,
    processor: str = "intel",
    scale: float | None = None,
    analog: int = 0,
) -> bytes:
    """A file of points (T, M, 3), NaN = not seen, and of so many analog numbers in each frame.

    Points are floating-point numbers, or with a `scale` whole numbers of that many units.
    """
    order = ">" if processor == "mips" else "<"

    def real(values: np.ndarray | float) -> bytes:
        array = np.atleast_1d(np.asarray(values, dtype=np.float32))
        if processor != "dec":
            return array.astype(f"{order}f4").tobytes()
        words = np.where(array == 0, 0, (4 * array).view(np.uint32))  # a VAX's exponent, its words exchanged
        return ((words << 16) | (words >> 16)).astype("<u4").tobytes()

    frames, count = places.shape[:2]
    wide = max(len(label) for label in labels)
    text = "".join(label.ljust(wide) for label in labels).encode()
    parameters = [
        ("USED", 2, (), struct.pack(f"{order}h", count)),
        ("FRAMES", 2, (), struct.pack(f"{order}h", frames)),
        ("SCALE", 4, (), real(scale or -1.0)),
        ("RATE", 4, (), real(rate_hz)),
        ("LABELS", -1, (wide, count), text),
        ("UNITS", -1, (len(unit),), unit.encode()),
    ]
    body = b"\x05\xffPOINT" + struct.pack(f"{order}h", 3) + b"\x00"
    for name, kind, size, value in parameters:
        tail = struct.pack("b", kind) + bytes([len(size), *size]) + value + b"\x00"
        body += bytes([len(name), 1]) + name.encode() + struct.pack(f"{order}h", 2 + len(tail)) + tail
    blocks = -(-(len(body) + 6) // 512)
    body = bytes([1, 0x50, blocks, PROCESSORS[processor]]) + body
    head = b"\x02\x50" + struct.pack(f"{order}5H", count, analog, 1, frames, 10) + real(scale or -1.0)
    head += struct.pack(f"{order}2H", blocks + 2, 0) + real(rate_hz)
    seen = np.isfinite(places).all(axis=-1, keepdims=True)
    values = np.concatenate(
        (np.where(seen, places / (scale or 1.0), 0.0), np.where(seen, 0.0, -1.0)), axis=-1
    )
    rows = np.concatenate((values.reshape(frames, -1), np.full((frames, analog), 7.0)), axis=1)
    written = real(rows.ravel()) if scale is None else np.rint(rows).astype(f"{order}i2").tobytes()
    return head.ljust(512, b"\x00") + body.ljust(512 * blocks, b"\x00") + written
