"""From markers on the skin to joint centres (`models/body/mocap.toml` has names, constants and sources)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from simrecon.evidence.axes import find_unit, metres
from simrecon.evidence.content import Content
from simrecon.evidence.mocap import names
from simrecon.evidence.mocap.points import NEEDED, points_evidence
from simrecon.evidence.options import Options
from simrecon.geometry import vectors
from simrecon.types import Array, Evidence


def to_evidence(
    content: Content, options: Options, labels: Sequence[str], places: Array, times: Array, unit: str | None
) -> Evidence:
    """Evidence of labelled markers.

    Args:
        content: the file.
        options: of the user.
        labels: of the M markers.
        places: (T, M, 3) in the file's unit and axes; NaN = not seen.
        times: (T,) s.
        unit: that the file states, or None.

    Raises:
        InputError: markers of too few joints.
    """
    if not len(labels) or not len(places):
        raise content.fail("markers", "none", "a file with markers and frames")
    if not np.isfinite(places).any():
        raise content.fail("markers", "none that is ever seen", "finite positions")
    at = {names.flat(label): places[:, i] for i, label in reversed(list(enumerate(labels)))}
    unit_name = find_unit(content.source, np.nan, options.unit, unit)[0] if options.unit or unit else "m"
    points, derived = centres(at, 1.0 / metres(unit_name))
    if missing := [name for name in NEEDED if name not in points]:
        there = ", ".join(labels[:80])
        raise content.fail(
            "markers", f"none that give {', '.join(missing)} (there are {there})", "a body's markers"
        )
    note = f"{len(labels)} markers"
    if derived:
        note += f"; estimated from markers beside them: {', '.join(derived)}"
    return points_evidence(content, options, points, times, unit, note)


def centres(at: Mapping[str, Array], metre: float) -> tuple[dict[str, Array], list[str]]:
    """Joint centres by name, (T, 3) each, and which of them are estimates.

    Args:
        at: markers by flattened name.
        metre: in the unit of the markers.
    """
    points: dict[str, Array] = {}
    for point, sets in names.table("marker").items():
        for named, side in names.sides(point):
            chosen = next(
                (
                    s
                    for s in ([names.on_side(name, side) for name in one] for one in sets)
                    if set(s) <= set(at)
                ),
                None,
            )
            if chosen is not None:
                points[named] = np.mean([at[name] for name in chosen], axis=0)
    derived = _hips(points, at, metre) + _shoulders(points, at) + _one_sided(points, at, metre)
    return points, derived


def _hips(points: dict[str, Array], at: Mapping[str, Array], metre: float) -> list[str]:
    """Hip centres from the iliac spines (Harrington et al. 2007)."""
    table = names.table("pelvis")
    if "left_hip" in points and "right_hip" in points:
        return []
    spines = {
        (end, side): next((at[n] for n in (names.on_side(m, side) for m in table[end]) if n in at), None)
        for end in ("front", "back")
        for side in ("l", "r")
    }
    if any(place is None for place in spines.values()):
        return []
    front, back = (
        (np.asarray(spines[end, "l"], float), np.asarray(spines[end, "r"], float))
        for end in ("front", "back")
    )
    middle, behind = (front[0] + front[1]) / 2, (back[0] + back[1]) / 2
    width = np.linalg.norm(front[0] - front[1], axis=-1, keepdims=True)
    depth = np.linalg.norm(middle - behind, axis=-1, keepdims=True)
    left = (front[0] - front[1]) / width
    forward = middle - behind
    forward = vectors.unit(forward - np.sum(forward * left, axis=-1, keepdims=True) * left)
    up = np.cross(forward, left)
    x, y, z = (
        slope * size + constant * metre
        for (slope, constant), size in (
            (table["depth"], depth),
            (table["sideways"], width),
            (table["up"], width),
        )
    )
    for name, sign in (("left_hip", 1.0), ("right_hip", -1.0)):
        points[name] = middle + x * forward + sign * y * left + z * up
    return ["left_hip", "right_hip"]


def _shoulders(points: dict[str, Array], at: Mapping[str, Array]) -> list[str]:
    """Shoulder centres below the acromia (Rab et al. 2002)."""
    table = names.table("acromion")
    acromia = [
        next((at[n] for n in (names.on_side(m, side) for m in table["markers"]) if n in at), None)
        for side in ("l", "r")
    ]
    if acromia[0] is None or acromia[1] is None or "left_hip" not in points or "left_shoulder" in points:
        return []
    left, right = acromia[0], acromia[1]
    down = vectors.unit((points["left_hip"] + points["right_hip"]) / 2 - (left + right) / 2)
    drop = table["drop"] * np.linalg.norm(left - right, axis=-1, keepdims=True)
    points["left_shoulder"], points["right_shoulder"] = left + drop * down, right + drop * down
    return ["left_shoulder", "right_shoulder"]


def _one_sided(points: dict[str, Array], at: Mapping[str, Array], metre: float) -> list[str]:
    """Knees and ankles from their outer marker: inward along the line of the hips, square to the thigh."""
    derived = []
    if "left_hip" not in points or "right_hip" not in points:
        return []
    across = points["right_hip"] - points["left_hip"]
    for point, entry in names.table("one_sided").items():
        for named, side in names.sides(point):
            marker = next(
                (at[n] for n in (names.on_side(m, side) for m in entry["markers"]) if n in at), None
            )
            if named in points or marker is None:
                continue
            along = vectors.unit(marker - points[named.split("_")[0] + "_hip"])
            inward = across if side == "l" else -across
            inward = vectors.unit(inward - np.sum(inward * along, axis=-1, keepdims=True) * along)
            points[named] = marker + entry["inward_m"] * metre * inward
            derived.append(named)
    return derived
