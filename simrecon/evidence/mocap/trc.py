"""TRC: labelled markers by frame, as text.

MOT, which holds joint angles, is no evidence: it is refused with a word on it.
"""

from __future__ import annotations

import numpy as np

from simrecon.evidence.content import Content
from simrecon.evidence.mocap import markers
from simrecon.evidence.options import Options
from simrecon.types import Array, Evidence

HEAD_LINES = 5


def matches(content: Content) -> bool:
    """Whether the file is TRC."""
    return content.kind == "text" and content.raw[:64].lstrip(b"\xef\xbb\xbf").startswith(b"PathFileType")


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
    """Evidence of the markers' joint centres."""
    labels, times, places, unit = parse(content)
    if options.fps is not None:
        times = np.arange(len(times)) / options.fps
    return markers.to_evidence(content, options, labels, places, times, unit)


def parse(content: Content) -> tuple[list[str], Array, Array, str]:
    """Labels, times (T,) s, places (T, M, 3) with NaN where a marker wasn't seen, and the unit's name.

    Raises:
        InputError: damaged.
    """
    lines = content.text.splitlines()
    if len(lines) < HEAD_LINES:
        raise content.fail("header", f"{len(lines)} lines", "a whole TRC file")
    header = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=False))
    header = {key.strip(): value.strip() for key, value in header.items()}
    if "Units" not in header or "NumMarkers" not in header:
        raise content.fail("header", lines[1][:80] or "nothing", "DataRate, NumFrames, NumMarkers, Units …")
    labels = [label.strip() for label in lines[3].split("\t")[2:] if label.strip()]
    stated = header["NumMarkers"]
    if not stated.isdecimal() or int(stated) != len(labels):
        raise content.fail("NumMarkers", f"{stated} for {len(labels)} labels", "the number of labels")
    rows = [line.rstrip("\r\n") for line in lines[HEAD_LINES:] if line.strip()]
    width = 2 + 3 * len(labels)
    values = np.full((len(rows), width), np.nan)
    for i, line in enumerate(rows):
        words = line.split("\t")[:width]
        try:
            values[i, : len(words)] = [float(word) if word.strip() else np.nan for word in words]
        except ValueError as error:
            raise content.fail(f"frame {i + 1}", str(error), "numbers, tab-separated") from error
    frames = header.get("NumFrames", "")
    if not frames.isdecimal() or int(frames) != len(rows):
        raise content.fail(
            "NumFrames",
            f"{frames or 'none'} for {len(rows)} frames",
            "the number of frames: is the file whole?",
        )
    if not len(rows) or np.isnan(values[:, 1]).any():
        raise content.fail(
            "Time", "frames without a time" if len(rows) else "no frames", "a time in every frame"
        )
    places = values[:, 2:].reshape(len(rows), len(labels), 3)
    places[(places == 0).all(axis=-1)] = np.nan  # how some programs write a marker that wasn't seen
    places[np.isnan(places).any(axis=-1)] = np.nan
    return labels, values[:, 1], places, header["Units"]
