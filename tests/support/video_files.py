"""Small videos, and a network that finds coloured rectangles in them."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np

from simrecon.evidence.video import blazepose
from simrecon.evidence.video.blazepose import NAMES, Pose, Region
from simrecon.evidence.video.candidates import Candidate

Person = tuple[float, float, float, tuple[int, int, int]]
"""x and y of the middle, height, colour."""
RED, BLUE, GREEN = (30, 30, 220), (220, 60, 30), (40, 200, 40)


def write(path: Path, images: list[np.ndarray], fps: float = 30.0, codec: str = "mp4v") -> Path:
    size = images[0].shape[1], images[0].shape[0]
    backend = cv2.CAP_OPENCV_MJPEG if codec == "MJPG" else cv2.CAP_FFMPEG  # FFmpeg's makes sizes even
    writer = cv2.VideoWriter(str(path), backend, cv2.VideoWriter.fourcc(*codec), fps, size)
    assert writer.isOpened()
    for image in images:
        writer.write(image)
    writer.release()
    return path


def scene(people: Sequence[Person], size: tuple[int, int] = (160, 120)) -> np.ndarray:
    """Standing rectangles on grey."""
    image = np.full((size[1], size[0], 3), 128, np.uint8)
    for x, y, height, colour in people:
        low = round(x - height / 8), round(y - height / 2)
        cv2.rectangle(image, low, (round(x + height / 8), round(y + height / 2)), colour, -1)
    return image


class Rectangles:
    """A network for `scene`: candidates for every rectangle, landmarks of the one nearest to the region."""

    def __init__(self) -> None:
        self.calls = {"candidates": 0, "pose": 0}

    @staticmethod
    def _found(image: np.ndarray) -> list[tuple[float, float, float]]:
        far = (np.abs(image.astype(int) - 128).max(axis=2) > 45).astype(np.uint8)
        count, _, stats, middles = cv2.connectedComponentsWithStats(far)
        rows = [(*middles[i], stats[i, cv2.CC_STAT_HEIGHT]) for i in range(1, count) if stats[i, 4] > 60]
        return [(float(x), float(y), float(h)) for x, y, h in rows]

    def candidates(self, image: np.ndarray, tile: tuple[int, int, int, int] | None = None) -> list[Candidate]:
        self.calls["candidates"] += 1
        left, top, width, height = tile or (0, 0, image.shape[1], image.shape[0])
        people = self._found(image[top : top + height, left : left + width])
        return [
            Candidate(0.9, np.zeros(4), Region(np.array([x + left, y + top]), 1.3 * h, 0.0))
            for x, y, h in people
        ]

    def pose(self, image: np.ndarray, region: Region) -> Pose:
        self.calls["pose"] += 1
        people = self._found(image)
        apart = [np.hypot(x - region.centre_px[0], y - region.centre_px[1]) for x, y, _ in people]
        if not people or min(apart) > region.side_px / 2:
            return Pose(np.zeros((33, 2)), np.zeros(33), np.zeros((33, 3)), 0.0, region)
        x, y, h = people[int(np.argmin(apart))]
        points = np.tile([x, y], (33, 1))
        for i, name in enumerate(NAMES):
            points[i, 0] += h / 16 if name.startswith("left") else -h / 16
            points[i, 1] += {"shoulder": -0.3, "hip": 0.05, "ankle": 0.5, "eye": -0.5}.get(
                name[5:].strip("_"), 0
            ) * h
        world = np.concatenate(((points - [x, y]) * 1.7 / h, np.zeros((33, 1))), axis=1)
        return Pose(points, np.full(33, 0.9), world, 0.99, Region(np.array([x, y]), 1.3 * h, 0.0))


def boxes(content: bytes, start: int = 0, end: int | None = None) -> Iterator[tuple[bytes, int, int]]:
    """(kind, start, end) of the boxes of an MP4."""
    end = len(content) if end is None else end
    while start + 8 <= end:
        size, kind = struct.unpack_from(">I4s", content, start)
        yield kind, start, start + size
        start += size


def find_box(content: bytes, *path: bytes) -> list[int]:
    """Starts of the nested boxes of a path."""
    starts, low, high = [], 0, len(content)
    for kind in path:
        _, start, high = next(one for one in boxes(content, low, high) if one[0] == kind)
        starts.append(start)
        low = start + 8
    return starts


def turn(path: Path) -> None:
    """Write the flag into an MP4 that players shall turn it by 90° clockwise."""
    content = bytearray(path.read_bytes())
    at = find_box(bytes(content), b"moov", b"trak", b"tkhd")[-1] + 8 + 40
    one = 1 << 16
    struct.pack_into(">9i", content, at, 0, one, 0, -one, 0, 0, 0, 0, 1 << 30)
    path.write_bytes(content)


def vary(path: Path, deltas: list[int]) -> None:
    """Give the frames of an MP4, whose index stands at its end, durations in ticks of its clock."""
    content = bytearray(path.read_bytes())
    parents = find_box(bytes(content), b"moov", b"trak", b"mdia", b"minf", b"stbl", b"stts")
    assert find_box(bytes(content), b"mdat")[0] < parents[0]
    start = parents[-1]
    (size,) = struct.unpack_from(">I", content, start)
    body = struct.pack(">I4sII", 16 + 8 * len(deltas), b"stts", 0, len(deltas))
    body += b"".join(struct.pack(">II", 1, delta) for delta in deltas)
    content[start : start + size] = body
    for parent in parents[:-1]:
        (old,) = struct.unpack_from(">I", content, parent)
        struct.pack_into(">I", content, parent, old + len(body) - size)
    path.write_bytes(content)


def widen(path: Path, width: int, height: int) -> None:
    """Write into an MP4, whose index stands at its end, that its pixels are not square."""
    content = bytearray(path.read_bytes())
    parents = find_box(bytes(content), b"moov", b"trak", b"mdia", b"minf", b"stbl", b"stsd")
    entry = parents[-1] + 16
    (size,) = struct.unpack_from(">I", content, entry)
    content[entry + size : entry + size] = struct.pack(">I4sII", 16, b"pasp", width, height)
    for box in (*parents, entry):
        (old,) = struct.unpack_from(">I", content, box)
        struct.pack_into(">I", content, box, old + 16)
    path.write_bytes(content)


def recode(path: Path, kind: bytes, settings: bytes) -> None:
    """Write into an MP4 of MPEG-4 that it is coded otherwise, so that no frame of it can be decoded."""
    content = path.read_bytes()
    assert content.count(b"mp4v") == content.count(b"esds") == 1
    path.write_bytes(content.replace(b"mp4v", kind).replace(b"esds", settings))


def timescale(path: Path) -> int:
    """Ticks per second of an MP4's track."""
    content = path.read_bytes()
    at = find_box(content, b"moov", b"trak", b"mdia", b"mdhd")[-1]
    return struct.unpack_from(">I", content, at + 20)[0]


def with_metadata(path: Path, key: str, data: bytes, *, inside_trak: bool, iso: bool) -> None:
    """Put one QuickTime metadata item into a file: a movie with nothing but that, before all else."""

    def box(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I4s", 8 + len(body), kind) + body

    name = key.encode()
    keys = box(b"keys", struct.pack(">II", 0, 1) + box(b"mdta", name))
    items = box(b"ilst", box(struct.pack(">I", 1), box(b"data", data)))
    handler = box(b"hdlr", b"\0" * 8 + b"mdta" + b"\0" * 13)
    meta = box(b"meta", (b"\0\0\0\0" if iso else b"") + handler + keys + items)
    path.write_bytes(
        box(b"ftyp", b"qt  \0\0\0\0") + box(b"moov", box(b"trak", meta) if inside_trak else meta)
    )


assert len(NAMES) == blazepose.COUNT
