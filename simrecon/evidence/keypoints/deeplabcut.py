"""DeepLabCut's CSV: rows `scorer`, (`individuals`,) `bodyparts` and `coords`, then one row for each frame."""

from __future__ import annotations

import csv

import numpy as np

from simrecon.evidence.content import Content
from simrecon.evidence.keypoints import layouts, tracks
from simrecon.evidence.options import Options
from simrecon.evidence.values import bounded
from simrecon.io.messages import counted
from simrecon.types import Array, Evidence

COORDINATES = ("x", "y", "likelihood")


def matches(content: Content) -> bool:
    """DeepLabCut's table of landmarks."""
    return content.kind == "text" and content.raw[:64].removeprefix(b"\xef\xbb\xbf").startswith(b"scorer,")


def read(content: Content, options: Options) -> Evidence:
    """Evidence of DeepLabCut's table, of one individual or several."""
    rows = [row for row in csv.reader(content.text.removeprefix("\ufeff").splitlines()) if row]
    header = {row[0]: row[1:] for row in rows[:4] if row[0] in ("individuals", "bodyparts", "coords")}
    parts, coordinates = header.get("bodyparts", []), header.get("coords", [])
    if not parts or coordinates != list(COORDINATES) * (len(coordinates) // 3):
        there = ", ".join(coordinates[:4]) or "none"
        raise content.fail("coords", there, "x, y, likelihood of each body part")
    for name, cells in header.items():
        if len(cells) != len(coordinates):
            raise content.fail(name, f"{len(cells)} cells", f"{len(coordinates)}, as coords has")
    owners = header.get("individuals", [""] * len(parts))
    people = list(dict.fromkeys(owners))
    labels = list(dict.fromkeys(parts))
    names = layouts.known(labels)
    if not any(names):
        valid = "names of COCO, BlazePose, OpenPose, SMPL or OpenSim"
        raise content.fail("bodyparts", ", ".join(labels[:6]), valid)
    detections = []
    for line, row in enumerate(rows[1 + len(header) :], start=2 + len(header)):
        frame, table = _numbers(content, f"line {line}", row, len(parts))
        for index, person in enumerate(people):
            places = np.full((len(labels), 3), np.nan)
            for part, owner, place in zip(parts[::3], owners[::3], table, strict=True):
                if owner == person:
                    places[labels.index(part)] = place
            scores = np.nan_to_num(places[:, 2])
            if (scores > 0).any():
                detections.append(tracks.detection(frame, places[:, :2], scores, person or None, index))
    crowns = [label for label, name in zip(labels, names, strict=True) if name == "head_top"]
    note = f"{crowns[0]} taken for the top of the head" if crowns and "top" not in crowns[0].lower() else ""
    return tracks.to_evidence(content, detections, names, options, note)


def _numbers(content: Content, line: str, row: list[str], count: int) -> tuple[int, Array]:
    """Number of a row's frame, and its landmarks (N, 3): x, y, likelihood; NaN where there is none."""
    valid = f"the number of the frame and {counted(count, 'number')}"
    try:
        frame, values = int(float(row[0])), np.array([float(word) if word else np.nan for word in row[1:]])
    except (ValueError, OverflowError) as error:
        raise content.fail(line, str(error), valid) from error
    if len(values) != count:
        raise content.fail(line, f"{counted(len(values), 'number')} after the first", valid)
    return frame, bounded(content, line, values).reshape(-1, 3)
