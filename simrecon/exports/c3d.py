"""C3D: joint centres and landmarks as points, and the forces of the scene on the feet as two force platforms.

Points in mm, world as in the result, z up. Platforms are of type 2: three forces and three moments about the
middle of the surface, in axes with z down, as force plates measure the reaction on the foot. Each feels one
foot alone (1 the right, 2 the left), wherever it stands. A motion that has no forces is written without.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any

import numpy as np

from simrecon.exports.forces import Forces, Loads, per_frame
from simrecon.exports.view import ResultView
from simrecon.types import Array

FEET = ("right_ankle", "left_ankle")
DOWN = np.diag([1.0, -1.0, -1.0])
"""Axes of a platform in the world, by columns; its own inverse."""
CHANNELS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
MM, BLOCK, INTEL, LARGEST = 1000.0, 512, 84, 65535
MARGIN_M = 0.3


def write(view: ResultView) -> dict[str, bytes]:
    """Points, and platforms where the motion is the one that was simulated, of the person as they are."""
    labels, places = view.body.skeleton.point_names, MM * view.points_m
    groups = {"POINT": _points(labels, view)}
    as_asked = view.choices.of == "simulation" and view.choices.legs == 1.0
    if not as_asked or not view.result.motion.knows_forces:
        groups["ANALOG"] = {"USED": 0, "RATE": float(view.rate_hz), "GEN_SCALE": 1.0}
        return {"motion.c3d": c3d(places, np.zeros((len(places), 0, 0)), view.rate_hz, groups)}
    samples, corners = platforms(view)
    names = [f"{channel}{plate}" for plate in (1, 2) for channel in CHANNELS]
    count = len(names)
    groups["ANALOG"] = {
        "USED": count,
        "RATE": view.rate_hz * samples.shape[1],
        "GEN_SCALE": 1.0,
        "SCALE": np.ones(count),
        "OFFSET": np.zeros(count, np.int16),
        "LABELS": names,
        "DESCRIPTIONS": [f"platform {name[2:]}, {name[:2]}" for name in names],
        "UNITS": [("N" if name[0] == "F" else "Nmm") for name in names],
    }
    groups["FORCE_PLATFORM"] = {
        "USED": 2,
        "TYPE": np.array([2, 2], np.int16),
        "ZERO": np.zeros(2, np.int16),
        "CORNERS": MM * np.stack([corners, corners]),  # the last axis is the fastest: x, y, z of a corner
        "ORIGIN": np.zeros((2, 3)),
        "CHANNEL": np.arange(1, count + 1, dtype=np.int16).reshape(2, 6),
    }
    return {"motion.c3d": c3d(places, samples, view.rate_hz, groups)}


def platforms(view: ResultView) -> tuple[Array, Array]:
    """Channels (G, n, 12) of both platforms, n samples a frame, N and N mm; the corners (4, 3), m."""
    forces = view.forces
    count = per_frame(forces, view.rate_hz)
    span_s = view.interval_s / count
    times_s = view.times_s[0] + span_s * np.arange(len(view.times_s) * count)
    loads = forces.at(times_s, span_s)
    corners = _corners(forces, loads, view)
    middle = corners.mean(axis=0)
    columns = []
    for foot in FEET:
        row = forces.segments.index(foot)
        force = loads.force_N[:, row]
        arm = np.where(np.isfinite(loads.centre_m[:, row]), loads.centre_m[:, row] - middle, 0.0)
        moment = loads.moment_Nm[:, row] + np.cross(arm, force)
        columns += [force @ DOWN, MM * moment @ DOWN]
    return np.concatenate(columns, axis=1).reshape(len(view.times_s), count, -1), corners


def _corners(forces: Forces, loads: Loads, view: ResultView) -> Array:
    """A rectangle (4, 3) under all that the feet do, at the height of the ground; the one at +x +y first."""
    rows = [forces.segments.index(foot) for foot in FEET]
    places = loads.centre_m[:, rows].reshape(-1, 3)
    places = places[np.isfinite(places).all(axis=1)]
    around = places[:, :2] if len(places) else view.qpos[:, :2]
    (x0, y0), (x1, y1) = around.min(axis=0) - MARGIN_M, around.max(axis=0) + MARGIN_M
    floor = view.result.scene.ground.height_m
    return np.array([(x1, y0, floor), (x0, y0, floor), (x0, y1, floor), (x1, y1, floor)])


def _points(labels: Sequence[str], view: ResultView) -> dict[str, Any]:
    return {
        "USED": len(labels),
        "FRAMES": min(len(view.times_s), LARGEST),
        "SCALE": -1.0,
        "RATE": float(view.rate_hz),
        "DATA_START": 0,  # see `c3d`
        "LABELS": list(labels),
        "DESCRIPTIONS": list(labels),
        "UNITS": ["mm"],
        "X_SCREEN": ["+X"],
        "Y_SCREEN": ["+Z"],
    }


def c3d(points: Array, analog: Array, rate_hz: float, groups: dict[str, dict[str, Any]]) -> bytes:
    """A file of floating-point numbers, little-endian (c3d.org, user guide of 2021).

    Args:
        points: (G, M, 3), all of them seen.
        analog: (G, n, A) n samples of A channels a frame.
        rate_hz: of frames.
        groups: parameters by name, by group; `DATA_START` is filled in.
    """
    frames, markers = points.shape[:2]
    samples, channels = analog.shape[1:]
    long = [frames % (LARGEST + 1), frames >> 16]
    trial = {"ACTUAL_START_FIELD": [1, 0], "ACTUAL_END_FIELD": long}
    groups = {**groups, "TRIAL": {key: np.array(word, np.uint16) for key, word in trial.items()}}
    blocks = -(-len(_parameters(groups, 0)) // BLOCK)
    start = blocks + 2
    body = _parameters(groups, start).ljust(BLOCK * blocks, b"\0")
    head = b"\x02\x50" + struct.pack("<5H", markers, samples * channels, 1, min(frames, LARGEST), 0)
    head += struct.pack("<f2Hf", -1.0, start, samples, rate_hz)
    seen = np.concatenate((points, np.zeros((frames, markers, 1))), axis=-1).reshape(frames, -1)
    rows = np.concatenate((seen, analog.reshape(frames, -1)), axis=1)
    content = rows.astype("<f4").tobytes()
    return head.ljust(BLOCK, b"\0") + body + content.ljust(-(-len(content) // BLOCK) * BLOCK, b"\0")


def _parameters(groups: dict[str, dict[str, Any]], start: int) -> bytes:
    """The section of parameters, whose data begin at a block."""
    chain = b""
    for number, (group, table) in enumerate(groups.items(), 1):
        chain += struct.pack("<2b", len(group), -number) + group.encode() + struct.pack("<hB", 3, 0)
        for name, value in table.items():
            tail = _value(start if name == "DATA_START" else value) + b"\0"
            chain += struct.pack("<2b", len(name), number) + name.encode()
            chain += struct.pack("<h", 2 + len(tail)) + tail
    blocks = -(-(len(chain) + 6) // BLOCK)
    return bytes([1, 0x50, blocks, INTEL]) + chain + b"\0\0"


def _value(value: Any) -> bytes:
    """Kind, dimensions (the fastest first) and data of a parameter."""
    if isinstance(value, list):
        wide = max(len(word) for word in value)
        text = "".join(word.ljust(wide) for word in value).encode("ascii")
        sizes = [wide] if len(value) == 1 else [wide, len(value)]
        return struct.pack("<2b", -1, len(sizes)) + bytes(sizes) + text
    array = np.asarray(value)
    kind, form = (
        (4, "<f4") if array.dtype.kind == "f" else (2, array.dtype if array.dtype.itemsize == 2 else "<u2")
    )
    return struct.pack("<2b", kind, array.ndim) + bytes(array.shape[::-1]) + array.astype(form).tobytes()
