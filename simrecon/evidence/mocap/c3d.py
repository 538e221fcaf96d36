"""C3D: labelled markers by frame, read by ezc3d (extra `c3d`)."""

from __future__ import annotations

import struct

import numpy as np

from simrecon.evidence.content import Content
from simrecon.evidence.mocap import markers
from simrecon.evidence.options import Options
from simrecon.io.limits import size_text
from simrecon.system import extras
from simrecon.types import Evidence

_BLOCK = 512


def matches(content: Content) -> bool:
    """Whether the file is C3D."""
    return content.kind == "c3d"


def read(content: Content, options: Options) -> Evidence:
    """Evidence of the markers' joint centres."""
    _check_size(content)
    ezc3d = extras.load("ezc3d", "c3d", f"{content.source}: the reader of C3D files")
    try:
        file = ezc3d.c3d(content.source)
        point = file["parameters"]["POINT"]
        labels = [str(label) for label in point["LABELS"]["value"]]
        rate, units = float(point["RATE"]["value"][0]), [str(u) for u in point["UNITS"]["value"]]
        places = np.moveaxis(np.asarray(file["data"]["points"], float)[:3], 0, -1)  # (M, T, 3)
        residual = np.asarray(file["data"]["meta_points"]["residuals"], float)[0]  # (M, T)
    except (OSError, RuntimeError, ValueError, KeyError, IndexError, TypeError, MemoryError) as error:
        reason = " ".join(str(error).split())
        raise content.fail(
            "content", f"damage ({reason})", "a whole C3D file with labelled points"
        ) from error
    places = np.swapaxes(np.where(residual[..., None] < 0, np.nan, places), 0, 1)
    rate = options.fps or rate
    if not rate > 0:
        raise content.fail("POINT.RATE", f"{rate:g}", "a frame rate above 0, or --fps")
    times = np.arange(places.shape[0]) / rate
    return markers.to_evidence(
        content, options, labels[: places.shape[1]], places, times, units[0] if units else None
    )


def _check_size(content: Content) -> None:
    """The header's number of points and frames against the size of the file, before anything is allocated."""
    raw = content.raw
    if len(raw) < _BLOCK:
        raise content.fail("header", size_text(len(raw)), "a whole C3D file")
    points, _analog, first, last = struct.unpack_from("<4H", raw, 2)
    (scale,) = struct.unpack_from("<f", raw, 12)
    (start,) = struct.unpack_from("<H", raw, 16)
    before = max(start - 1, 0) * _BLOCK
    claimed = before + points * max(last - first + 1, 0) * (16 if scale < 0 else 8)
    if claimed > len(raw):
        there = (
            f"{points} points in {last - first + 1} frames ({size_text(claimed)}) in {size_text(len(raw))}"
        )
        raise content.fail("header", there, "a whole C3D file")
