"""TRC: labelled points by frame, as text, read as leniently as OpenSim reads it.

MOT, which holds joint angles, is no evidence: it is refused with a word on it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simrecon.evidence.content import Content
from simrecon.evidence.mocap import markers
from simrecon.evidence.options import Options
from simrecon.types import Array, Evidence

LABEL_LINE = 3
_UNSEEN = re.compile(r"-?(nan|1\.#\w+)?", re.IGNORECASE)  # also as old C libraries write it
_AXIS = re.compile(r"[xyz]\d+", re.IGNORECASE)


@dataclass(frozen=True)
class Table:
    """What a TRC file holds.

    Attributes:
        labels: M labels.
        times_s: (T,).
        places: (T, M, 3) in the file's unit and axes; NaN = not seen.
        unit: as the file names it; empty if it does not.
        notes: what its header has wrong, and what was left out.
    """

    labels: list[str]
    times_s: Array
    places: Array
    unit: str
    notes: tuple[str, ...]


def matches(content: Content) -> bool:
    """Whether the file is TRC."""
    return content.kind == "text" and content.text[:64].startswith("PathFileType")


def matches_mot(content: Content) -> bool:
    """Whether the file is an OpenSim storage (MOT, STO)."""
    return content.kind == "text" and b"endheader" in content.raw[:20_000].lower()


def read_mot(content: Content, _options: Options) -> Evidence:
    """Refuse joint angles, which fit only the OpenSim model they were computed with, and forces.

    Raises:
        InputError: always.
    """
    columns = content.text.lower().partition("endheader")[2].split("\n", 2)[1:2]
    there = "joint angles (MOT, STO), which fit only the model they were made with"
    if "force" in "".join(columns):
        there = "forces (MOT, STO), which do not say how the person moves"
    raise content.fail("format", there, "the markers of the same trial (TRC)")


def read(content: Content, options: Options) -> Evidence:
    """Evidence of the points' joint centres."""
    table = parse(content)
    times = table.times_s if options.fps is None else np.arange(len(table.times_s)) / options.fps
    return markers.to_evidence(content, options, table.labels, table.places, times, table.unit, table.notes)


def parse(content: Content) -> Table:
    """The labels, times and places of a file.

    Raises:
        InputError: damaged.
    """
    lines = content.text.splitlines()
    if len(lines) <= LABEL_LINE:
        raise content.fail("header", f"{len(lines)} lines", "a whole TRC file")
    header = {key.lower(): value for key, value in zip(lines[1].split(), lines[2].split(), strict=False)}
    if "datarate" not in header and "units" not in header:
        raise content.fail(
            "header", lines[1].strip()[:80] or "nothing", "DataRate, NumFrames, NumMarkers, Units …"
        )
    labels = _labels(content, lines)
    rows = [
        (number, cells)
        for number, line in enumerate(lines[LABEL_LINE + 1 :], start=LABEL_LINE + 2)
        if line.strip() and not _AXIS.fullmatch((cells := _cells(line, 2 + 3 * len(labels)))[_first(cells)])
    ]
    if not rows:
        raise content.fail("Time", "no frames", "a time in every frame")
    notes = []
    width = 2 + 3 * len(labels)
    if len(rows) > 1 and len(rows[-1][1]) < min(width, min(len(cells) for _, cells in rows[:-1])):
        notes.append("the last line is cut short and left out")
        rows.pop()
    values = _values(content, rows, width)
    for key, count, what in (("nummarkers", len(labels), "labels"), ("numframes", len(rows), "frames")):
        if header.get(key) != str(count):
            notes.append(f"the header says {header.get(key, 'nothing')} where there are {count} {what}")
    times = _times(content, values[:, 1], header.get("datarate", ""), notes)
    places = values[:, 2:].reshape(len(rows), len(labels), 3)
    places[(places == 0).all(axis=-1)] = np.nan  # how some programs write a marker that wasn't seen
    places[np.isnan(places).any(axis=-1)] = np.nan
    unit = header.get("units", "")
    return Table(labels, times, places, "" if unit[:1].isdigit() else unit, tuple(notes))  # of an empty cell


def _labels(content: Content, lines: Sequence[str]) -> list[str]:
    """The labels, with an empty one where a point has none."""
    line = lines[LABEL_LINE]
    cells = [cell.strip() for cell in (line.split("\t") if "\t" in line else line.split())][2:]
    while cells and not cells[-1]:
        cells.pop()
    named = [cell for cell in cells if cell]
    if not named:
        raise content.fail("labels", repr(line[:40]), "the names of the markers in line 4")
    spaced = all(not cell for i, cell in enumerate(cells) if i % 3)  # each above three columns
    labels = cells[::3] if spaced and len(cells) > 1 else named
    axes = lines[LABEL_LINE + 1].split() if len(lines) > LABEL_LINE + 1 else []
    columns = sum(bool(_AXIS.fullmatch(cell)) for cell in axes)
    return labels if columns != 3 * len(named) else named


def _cells(line: str, width: int) -> list[str]:
    """The cells of a line: between tabs, of which a run counts as one if there are too many, or spaces."""
    if "\t" not in line:
        return line.split()
    cells = [cell.strip() for cell in line.split("\t")]
    while len(cells) > width and not cells[-1]:
        cells.pop()
    if len(cells) > width and len(filled := [cell for cell in cells if cell]) <= width:
        return filled
    return cells


def _first(cells: Sequence[str]) -> int:
    """Index of the first cell that is not empty."""
    return next((i for i, cell in enumerate(cells) if cell), 0)


def _values(content: Content, rows: Sequence[tuple[int, list[str]]], width: int) -> Array:
    """Numbers (T, C); NaN for empty cells."""
    values = np.full((len(rows), width), np.nan)
    for i, (number, cells) in enumerate(rows):
        if len(cells) > width:
            there = f"{len(cells)} cells for {(width - 2) // 3} labels"
            raise content.fail(
                f"line {number}", there, f"at most {width}: number, time, and three for each label"
            )
        try:
            values[i, : len(cells)] = [np.nan if _UNSEEN.fullmatch(cell) else float(cell) for cell in cells]
        except ValueError as error:
            found = str(error).removeprefix("could not convert string to float: ")
            raise content.fail(f"line {number}", found, "numbers with a point, tab-separated") from error
    return values


def _times(content: Content, times: Array, rate: str, notes: list[str]) -> Array:
    """Times in s, by the frame rate of the header where a file has none."""
    if not np.isnan(times).any():
        return times
    try:
        rate_hz = float(rate)
    except ValueError:
        rate_hz = 0.0
    if not np.isnan(times).all() or not 0 < rate_hz < np.inf:
        raise content.fail("Time", "frames without a time", "a time in every frame")
    notes.append(f"no times: {rate_hz:g} frames per second, as the header says")
    return np.arange(len(times)) / rate_hz
