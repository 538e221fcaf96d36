"""C3D: labelled markers by frame, read by ezc3d (extra `c3d`)."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any

import numpy as np

from simrecon.evidence.content import Content
from simrecon.evidence.mocap import markers
from simrecon.evidence.options import Options
from simrecon.io.limits import size_text
from simrecon.io.messages import counted
from simrecon.system import extras
from simrecon.types import Evidence

_BLOCK = 512
_OUTPUTS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS")
_INTEL, _DEC, _BIG_ENDIAN = 84, 85, 86
"""Kinds of processor, the fourth byte of the parameters."""


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
        labels, outputs = _labels(point), _outputs(point)
        rate, units = float(point["RATE"]["value"][0]), [str(u) for u in point["UNITS"]["value"]]
        places = np.moveaxis(np.asarray(file["data"]["points"], float)[:3], 0, -1)  # (M, T, 3)
        residual = np.asarray(file["data"]["meta_points"]["residuals"], float)[0]  # (M, T)
    except (OSError, RuntimeError, ValueError, KeyError, IndexError, TypeError, MemoryError) as error:
        reason = " ".join(str(error).split())
        raise content.fail(
            "content", f"damage ({reason})", "a whole C3D file with labelled points"
        ) from error
    unseen = (residual < 0) | (places == 0).all(axis=-1)
    places = np.swapaxes(np.where(unseen[..., None], np.nan, places), 0, 1)
    kept = [i for i, label in enumerate(labels[: places.shape[1]]) if label not in outputs]
    rate = options.fps or rate
    if not rate > 0:
        raise content.fail("POINT.RATE", f"{rate:g}", "a frame rate above 0, or --fps")
    times = np.arange(places.shape[0]) / rate
    names = [labels[i] for i in kept]
    return markers.to_evidence(content, options, names, places[:, kept], times, units[0] if units else None)


def _labels(point: Mapping[str, Any]) -> list[str]:
    """The labels of all points, which lie in several parameters where there are more than 255."""
    groups = [name for name in ("LABELS", *(f"LABELS{i}" for i in range(2, 10))) if name in point]
    return [str(label).strip() for name in groups for label in point[name]["value"]]


def _outputs(point: Mapping[str, Any]) -> frozenset[str]:
    """Labels of what a model has computed: angles, forces and the like, in the columns of points."""
    groups = (point.get(name, {}).get("value", ()) for name in _OUTPUTS)
    return frozenset(str(label).strip() for group in groups for label in group)


def _check_size(content: Content) -> None:
    """The header's number of points and frames against the size of the file, before anything is allocated."""
    raw = content.raw
    if len(raw) < _BLOCK:
        raise content.fail("header", size_text(len(raw)), "a whole C3D file")
    kind_at = max(raw[0] - 1, 0) * _BLOCK + 3
    kind = raw[kind_at] if kind_at < len(raw) else _INTEL
    if kind == _BIG_ENDIAN:
        there = "big-endian numbers (an SGI or MIPS workstation's), which ezc3d does not read"
        valid = "the file written anew for Intel processors, as Mokka, BTK and Vicon Nexus do, or as TRC"
        raise content.fail("byte order", there, valid)
    points, _analog, first, last = struct.unpack_from("<4H", raw, 2)
    floats = raw[13 if kind == _DEC else 15] & 0x80  # the sign of the scale: negative for floating point
    (start,) = struct.unpack_from("<H", raw, 16)
    before = max(start - 1, 0) * _BLOCK
    claimed = before + points * max(last - first + 1, 0) * (16 if floats else 8)
    if claimed > len(raw):
        there = f"{counted(points, 'point')} in {counted(last - first + 1, 'frame')} ({size_text(claimed)})"
        there += f" in {size_text(len(raw))}"
        raise content.fail("header", there, "a whole C3D file")
