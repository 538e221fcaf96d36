"""From markers on the skin to joint centres (`models/body/markers.toml` has constants and sources).

All places are (T, 3) in metres; NaN where a marker was not seen. Skin markers go by the names of `[skin]`,
joint centres by those of `landmarks.toml`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from simrecon.evidence.mocap.labels import table
from simrecon.evidence.mocap.size import SIDES, middle, square
from simrecon.geometry import vectors
from simrecon.types import Array

PAIR_SHARE = 0.5
"""A second marker of a joint that is seen less often, as a share of the first one's frames, is left out."""

Points = dict[str, Array]


def joints(skin: Mapping[str, Array], points: Points) -> list[str]:
    """Add the centres that the markers give to those known already; returns the names of estimates.

    Args:
        skin: markers by name.
        points: joint centres by name, which are filled up.
    """
    estimates = _hips(skin, points)
    for joint in ("knee", "ankle", "elbow"):
        _between(skin, points, joint, f"{joint}_lateral", f"{joint}_medial")
    _between(skin, points, "wrist", "wrist_radius", "wrist_ulna")
    if {"left_hip", "right_hip"} <= set(points):
        for joint, above in (("knee", "hip"), ("ankle", "knee")):
            estimates += _beside(skin, points, joint, above)
        estimates += _shoulders(skin, points)
    for side in SIDES:
        single = next(
            (skin[n] for n in (f"{side}_wrist", f"{side}_wrist_radius", f"{side}_wrist_ulna") if n in skin),
            None,
        )
        if single is not None and f"{side}_wrist" not in points:
            points[f"{side}_wrist"] = single
            estimates.append(f"{side}_wrist")
    estimates += _elbows(skin, points)
    return estimates


def trunk(skin: Mapping[str, Array], points: Points, stature_m: float) -> list[str]:
    """Neck and top of the head from the markers on them, where nothing has named them; names of estimates."""
    estimates = []
    if "neck" not in points and (place := _neck(skin, points, stature_m)) is not None:
        points["neck"] = place
        estimates.append("neck")
    if (
        not {"head_top", "head", "skull_base"} & set(points)
        and (place := _crown(skin, points, stature_m)) is not None
    ):
        points["head_top"] = place
        estimates.append("head_top")
    return estimates


def _hips(skin: Mapping[str, Array], points: Points) -> list[str]:
    """Hip centres from the iliac spines (Harrington et al. 2007), or else from the greater trochanters."""
    if "left_hip" in points and "right_hip" in points:
        return []
    names = ["left_hip", "right_hip"]
    back = _both(skin, "psis")
    back = skin.get("sacrum") if back is None else back
    front = _both(skin, "asis")
    if front is not None and back is not None:
        points["left_hip"], points["right_hip"] = harrington(skin["left_asis"], skin["right_asis"], back)
        return names
    if _both(skin, "trochanter") is not None:
        left, right = (skin[f"{side}_trochanter"] for side in SIDES)
        inward = float(table("pelvis")["trochanter"]) * (right - left)
        points["left_hip"], points["right_hip"] = left + inward, right - inward
        return names
    return []


def narrowed(points: Points, stature_m: float) -> str:
    """Hips that are too far apart for joints lie on the greater trochanters; a note for the reading."""
    left, right, pelvis = points["left_hip"], points["right_hip"], table("pelvis")
    apart = np.linalg.norm(right - left, axis=-1)
    if not np.isfinite(apart).any() or np.nanmedian(apart) < float(pelvis["widest"]) * stature_m:
        return ""
    inward = float(pelvis["trochanter"]) * (right - left)
    points["left_hip"], points["right_hip"] = left + inward, right - inward
    return f"hips {1e3 * np.nanmedian(apart):.0f} mm apart lie on the trochanters: moved inward by a quarter"


def harrington(left_asis: Array, right_asis: Array, back: Array) -> tuple[Array, Array]:
    """Hip centres by the width and depth of the pelvis, Harrington et al. 2007, table 2; (T, 3) each.

    Args:
        left_asis: front iliac spine.
        right_asis: the other one.
        back: the middle of the rear ones, or a marker on the sacrum.
    """
    coefficients = table("pelvis")
    front = (left_asis + right_asis) / 2
    width = np.linalg.norm(left_asis - right_asis, axis=-1, keepdims=True)
    depth = np.linalg.norm(front - back, axis=-1, keepdims=True)
    left = vectors.unit(left_asis - right_asis)
    forward = square(front - back, left)
    up = np.cross(forward, left)
    x, y, z = (
        slope * size + constant
        for (slope, constant), size in (
            (coefficients["depth"], depth),
            (coefficients["sideways"], width),
            (coefficients["up"], width),
        )
    )
    centre = front + x * forward + z * up
    return centre + y * left, centre - y * left


def _both(skin: Mapping[str, Array], marker: str) -> Array | None:
    """Between the left and the right marker; None without both."""
    return middle(skin, marker) if {f"{side}_{marker}" for side in SIDES} <= set(skin) else None


def _between(skin: Mapping[str, Array], points: Points, joint: str, outer: str, inner: str) -> None:
    """The middle between the two markers of a joint."""
    for side in SIDES:
        a, b = skin.get(f"{side}_{outer}"), skin.get(f"{side}_{inner}")
        if f"{side}_{joint}" in points or a is None or b is None:
            continue
        both = (a + b) / 2
        if np.isfinite(both).all(-1).sum() > PAIR_SHARE * np.isfinite(a).all(-1).sum():
            points[f"{side}_{joint}"] = both


def _beside(skin: Mapping[str, Array], points: Points, joint: str, above: str) -> list[str]:
    """Knees and ankles from their outer marker: inward along the line of the hips, square to the limb."""
    estimates = []
    across = points["right_hip"] - points["left_hip"]
    for side, inward in zip(SIDES, (across, -across), strict=True):
        name, marker, start = (
            f"{side}_{joint}",
            skin.get(f"{side}_{joint}_lateral"),
            points.get(f"{side}_{above}"),
        )
        if name in points or marker is None or start is None:
            continue
        points[name] = marker + float(table("inward_m")[joint]) * square(inward, vectors.unit(marker - start))
        estimates.append(name)
    return estimates


def _shoulders(skin: Mapping[str, Array], points: Points) -> list[str]:
    """Shoulder centres below the acromia (`[acromion]` of markers.toml)."""
    names = ["left_shoulder", "right_shoulder"]
    between = _both(skin, "acromion")
    if between is None or set(names) & set(points):
        return []
    left, right = skin["left_acromion"], skin["right_acromion"]
    down = vectors.unit(middle(points, "hip") - between)
    drop = float(table("acromion")["drop"]) * np.linalg.norm(left - right, axis=-1, keepdims=True)
    points["left_shoulder"], points["right_shoulder"] = left + drop * down, right + drop * down
    return names


def _elbows(skin: Mapping[str, Array], points: Points) -> list[str]:
    """Elbows from their outer marker: inward along the axis that the arm is bent about."""
    estimates = []
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        name, marker = f"{side}_elbow", skin.get(f"{side}_elbow_lateral")
        if name in points or marker is None:
            continue
        points[name] = marker
        estimates.append(name)
        shoulder, wrist = points.get(f"{side}_shoulder"), points.get(f"{side}_wrist")
        if shoulder is None or wrist is None or not {"left_hip", "right_hip"} <= set(points):
            continue
        upper, lower = vectors.unit(marker - shoulder), vectors.unit(wrist - marker)
        across = vectors.unit(points["right_hip"] - points["left_hip"])
        inward = sign * (np.cross(upper, lower) + 0.2 * across)  # a straight arm has no axis
        points[name] = marker + float(table("inward_m")["elbow"]) * square(inward, upper)
    return estimates


def _neck(skin: Mapping[str, Array], points: Points, stature_m: float) -> Array | None:
    """The centre of the joint below C7 (Dumas, Chèze & Verriest 2007); None without a marker on C7."""
    c7, between = skin.get("c7"), table("neck")
    if c7 is None:
        return None
    up = vectors.unit(c7 - middle(points, "hip"))
    left = square(points["left_hip"] - points["right_hip"], up)
    if {"left_shoulder", "right_shoulder"} <= set(points):
        left = square(points["left_shoulder"] - points["right_shoulder"], up)
    front = skin.get("jugular")
    front = _both(skin, "clavicle") if front is None else front
    if front is None:
        slope, depth = np.radians(between["slope_deg"]), float(between["depth"]) * stature_m
        front = c7 + depth * (np.cos(slope) * np.cross(left, up) - np.sin(slope) * up)
    reach, rise = front - c7, np.radians(between["rise_deg"])
    across = np.linalg.norm(reach, axis=-1, keepdims=True)
    along = vectors.unit(reach)
    above = np.cross(along, left)
    place: Array = c7 + float(between["share"]) * across * (
        np.cos(rise) * along + np.sin(rise) * vectors.unit(above)
    )
    return place


def _crown(skin: Mapping[str, Array], points: Points, stature_m: float) -> Array | None:
    """The top of the head, from a marker on it or from the band around the head; None without either."""
    crown = table("crown")
    if (vertex := skin.get("vertex")) is not None:
        up = vectors.unit(vertex - points.get("neck", middle(points, "hip")))
        return np.asarray(vertex - float(crown["marker_m"]) * up)
    front, back = _both(skin, "head_front"), _both(skin, "head_back")
    if front is None or back is None:
        return None
    left = vectors.unit(skin["left_head_front"] - skin["right_head_front"])
    up = np.cross(square(front - back, left), left)
    return np.asarray((front + back) / 2 + float(crown["band"]) * stature_m * up)
