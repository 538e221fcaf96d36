"""The parts of a C3D file: header, parameters and points, as written on any processor.

Motion Lab Systems, "The C3D File Format: A Technical User Guide" (c3d.org).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from simrecon.evidence.content import Content
from simrecon.io.limits import size_text
from simrecon.io.messages import counted
from simrecon.types import Array

BLOCK = 512
INTEL, DEC, MIPS = 84, 85, 86
"""Kinds of processor, the fourth byte of the parameters."""
_CHARACTER, _SIZES = -1, {-1: 1, 1: 1, 2: 2, 4: 4}
"""Kind of a parameter's value, and bytes of each: characters, bytes, whole numbers, real numbers."""
_LARGEST_WORD = 65535


@dataclass(frozen=True, eq=False)
class C3d:
    """What a C3D file holds of its points.

    Attributes:
        parameters: values by group and name in capitals: lists of text, or arrays of all numbers in a row.
        places: (T, M, 3) in the file's unit; NaN = not seen.
        rate_hz: that the header states.
        processor: one of `INTEL`, `DEC`, `MIPS`.
    """

    parameters: dict[str, dict[str, Any]]
    places: Array
    rate_hz: float
    processor: int


@dataclass(frozen=True, eq=False)
class _Numbers:
    """Reads numbers of a processor out of bytes; fails where the file ends before."""

    content: Content
    processor: int

    def words(self, at: int, count: int, *, signed: bool = False) -> Array:
        """Numbers of two bytes from a byte on."""
        order = ">" if self.processor == MIPS else "<"
        kind = f"{order}{'i' if signed else 'u'}2"
        return np.frombuffer(self.piece(at, 2 * count), kind).astype(np.int64)

    def reals(self, at: int, count: int) -> Array:
        """Numbers of four bytes from a byte on."""
        raw = self.piece(at, 4 * count)
        if self.processor == DEC:  # the halves are exchanged, and the exponent counts from 2 more
            halves = np.frombuffer(raw, "<u2").reshape(-1, 2)
            return np.ascontiguousarray(halves[:, ::-1]).view("<f4")[:, 0].astype(float) / 4
        return np.frombuffer(raw, ">f4" if self.processor == MIPS else "<f4").astype(float)

    def piece(self, at: int, size: int) -> bytes:
        """So many bytes from one on."""
        raw = self.content.raw
        if at + size > len(raw):
            raise damage(self.content, f"it ends after {size_text(len(raw))}, before what it announces")
        return raw[at : at + size]


def parse(content: Content) -> C3d:
    """The parts of a file.

    Raises:
        InputError: it is damaged.
    """
    raw = content.raw
    if len(raw) < BLOCK:
        raise content.fail("header", size_text(len(raw)), "a whole C3D file")
    at = max(raw[0] - 1, 1) * BLOCK
    processor = raw[at + 3] if at + 3 < len(raw) and raw[at + 3] in (DEC, MIPS) else INTEL
    numbers = _Numbers(content, processor)
    parameters = _parameters(numbers, at + 4)
    with np.errstate(invalid="ignore"):  # damaged numbers may be signalling ones
        places = _places(numbers, parameters)
    return C3d(parameters, places, float(numbers.reals(20, 1)[0]), processor)


def damage(content: Content, reason: str) -> Exception:
    """The error of a damaged file, to be raised."""
    return content.fail("content", f"damage ({reason})", "a whole C3D file with labelled points")


def _parameters(numbers: _Numbers, at: int) -> dict[str, dict[str, Any]]:
    """Values by group and name: a chain in which each member tells where the next one begins."""
    groups: dict[int, str] = {}
    found: list[tuple[int, str, Any]] = []
    raw = numbers.content.raw
    while at + 2 <= len(raw) and raw[at]:
        length, group = abs(_signed(raw[at])), _signed(raw[at + 1])
        name = _text(numbers.piece(at + 2, length)).upper()
        at += 2 + length
        step = int(numbers.words(at, 1)[0])
        end = at + 2
        if group < 0:
            groups[-group] = name
        else:
            value, end = _value(numbers, end)
            found.append((group, name, value))
        if not step:
            break
        at += step
        if at < end or at + 2 > len(raw):
            raise damage(numbers.content, f"a parameter {name[:20]!r} after which none can begin")
    tables: dict[str, dict[str, Any]] = {name: {} for name in groups.values()}
    for group, name, value in found:
        if group in groups:
            tables[groups[group]][name] = value
    return tables


def _value(numbers: _Numbers, at: int) -> tuple[Any, int]:
    """A parameter's value, by its kind, its shape, and its numbers or characters, and where it ends."""
    kind, dimensions = _signed(numbers.piece(at, 1)[0]), numbers.piece(at + 1, 1)[0]
    shape = list(numbers.piece(at + 2, dimensions))
    if kind not in _SIZES:
        raise damage(numbers.content, f"a parameter of kind {kind}")
    count, at = math.prod(shape), at + 2 + dimensions
    end, raw = at + count * _SIZES[kind], numbers.piece(at, count * _SIZES[kind])
    if kind == _CHARACTER:
        wide = shape[0] if shape else 1
        return [_text(raw[i : i + wide]) for i in range(0, count, wide)] if wide else [], end
    if kind == 4:
        return numbers.reals(at, count), end
    return numbers.words(at, count) if kind == 2 else np.frombuffer(raw, "u1"), end


def _places(numbers: _Numbers, parameters: dict[str, dict[str, Any]]) -> Array:
    """Places (T, M, 3) of all points; NaN where the residual is negative or all is zero."""
    point = parameters.get("POINT", {})
    points, analog, first, last = (int(word) for word in numbers.words(2, 4))
    scale = number(point.get("SCALE"), numbers.reals(12, 1)[0])
    frames, size = _frames(parameters, last - first + 1, last), 4 if scale < 0 else 2
    start = max(int(numbers.words(16, 1)[0]) or int(number(point.get("DATA_START"), 1)), 1) - 1
    row = 4 * points + analog
    if (claimed := BLOCK * start + frames * row * size) > len(numbers.content.raw):
        there = f"{counted(points, 'point')} in {counted(frames, 'frame')} ({size_text(claimed)})"
        there += f" in {size_text(len(numbers.content.raw))}"
        raise numbers.content.fail("header", there, "a whole C3D file")
    read = numbers.reals if scale < 0 else lambda at, count: numbers.words(at, count, signed=True)
    values = read(BLOCK * start, frames * row).reshape(frames, row)[:, : 4 * points]
    values = values.reshape(frames, points, 4)
    places = values[..., :3] * (1.0 if scale < 0 else scale)
    unseen = (values[..., 3] < 0) | (places == 0).all(axis=-1)
    return np.where(unseen[..., None], np.nan, places)


def _frames(parameters: dict[str, dict[str, Any]], count: int, last: int) -> int:
    """Number of frames: where a word is too short for it, parameters have it."""
    if last < _LARGEST_WORD:
        return max(count, 0)
    trial, point = parameters.get("TRIAL", {}), parameters.get("POINT", {})
    ends = [trial.get(f"ACTUAL_{end}_FIELD", ()) for end in ("START", "END")]
    if all(len(words) == 2 for words in ends):
        begin, end = (int(low) % (_LARGEST_WORD + 1) + (int(high) << 16) for low, high in ends)
        return max(end - begin + 1, 0)
    longest = number(point.get("LONG_FRAMES"), count)
    return int(longest) if 0 <= longest < 1e9 else count


def number(values: Any, otherwise: float) -> float:
    """The first number of a parameter; another one where there is none that is finite."""
    there = values is not None and len(values) and not isinstance(values[0], str)
    for value in ([values[0]] if there else []) + [otherwise]:
        if math.isfinite(value):
            return float(value)
    return 0.0


def _signed(byte: int) -> int:
    return byte - 256 if byte > 127 else byte


def _text(raw: bytes) -> str:
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")
