"""Heels and toes on the sole, from markers on the skin or the shoe (`models/body/markers.toml`, `[foot]`)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from simrecon.evidence.mocap.labels import table
from simrecon.evidence.mocap.size import SIDES, square
from simrecon.geometry import vectors
from simrecon.types import Array

LOWEST_SHARE = 0.05
"""Of heights that are lower than all others, to leave out errors."""


def ankles(skin: Mapping[str, Array], points: dict[str, Array], stature_m: float) -> list[str]:
    """Add ankles that no marker shows, in the plane of heel, toes and hip; returns their names.

    The centre lies as far before the heel as a foot of this body has it, and as high over the sole.

    Args:
        skin: markers by name, (T, 3) m.
        points: joint centres by name, which are filled up.
        stature_m: of the person, roughly.
    """
    foot, estimates = table("foot"), []
    ahead = float(foot["behind"]) / (1 + float(foot["behind"])) * float(foot["length"]) * stature_m
    above = float(foot["ankle"]) * stature_m - float(foot["marker_height_m"])
    for side in SIDES:
        name, hip, heel = f"{side}_ankle", points.get(f"{side}_hip"), skin.get(f"{side}_heel")
        front, _ = _front(skin, side)
        if name in points or hip is None or heel is None or front is None:
            continue
        forward = vectors.unit(front - heel)
        up = square(hip - heel, forward)
        points[name] = heel + (ahead + float(foot["marker_m"])) * forward + above * up
        estimates.append(name)
    return estimates


def soles(
    skin: Mapping[str, Array], points: dict[str, Array], stature_m: float, *, shod: bool = False
) -> str:
    """Add heels and toes, or the joints of the big toes, to the joint centres; a note for the reading.

    The tip of the foot lies beyond the marker on the forefoot, as far from the heel as a foot is long: that
    marker may be on the knuckles of the toes, on the toes or on the tip of the shoe.

    Args:
        skin: markers or keypoints by name, `heel`, `toe_tip`, `toe`, `toe_medial` and `toe_lateral` of each
            side among them, (T, 3) m.
        points: joint centres by name, which are filled up.
        stature_m: of the person.
        shod: whether soles may be those of shoes, on the floor of a laboratory, which is at zero.
    """
    foot, ends = table("foot"), {}
    left = points["left_hip"] - points["right_hip"]
    for side in SIDES:
        ankle, heel = points[f"{side}_ankle"], skin.get(f"{side}_heel")
        front, at_tip = _front(skin, side)
        if front is None:
            continue
        if heel is None:
            if at_tip:
                points[f"{side}_toe"] = front
                points[f"{side}_heel"] = _heel(ankle, front, left, stature_m)
            else:
                points[f"{side}_mtp"] = front
            continue
        forward = vectors.unit(front - heel)
        up = square(ankle - heel, forward)
        length = np.nanmedian(np.linalg.norm(front - heel, axis=-1)) if np.isfinite(forward).any() else 0.0
        toe = heel + max(length, float(foot["length"]) * stature_m) * forward
        ends[side] = (heel, toe, up, _depth(ankle - heel, up, stature_m))
    shoe = _shoe(ends) if shod else 0.0
    for side, (heel, toe, up, depth) in ends.items():
        points[f"{side}_heel"], points[f"{side}_toe"] = (end - (depth + shoe) * up for end in (heel, toe))
    if not ends:
        return ""
    mean = np.mean([depth + shoe for _, _, _, depth in ends.values()])
    return f"soles {1e3 * mean:.0f} mm below heels and toes"


def _shoe(ends: Mapping[str, tuple[Array, Array, Array, float]]) -> float:
    """What is left between bare soles and a floor at zero, m: the thickness of shoes, if it can be one."""
    if not ends:
        return 0.0
    heights = np.concatenate(
        [end[:, 2] - depth * up[:, 2] for heel, toe, up, depth in ends.values() for end in (heel, toe)]
    )
    if not np.isfinite(heights).any():
        return 0.0
    lowest = float(np.nanquantile(heights, LOWEST_SHARE))
    return lowest if 0 < lowest < float(table("foot")["shoe_m"]) else 0.0


def _front(skin: Mapping[str, Array], side: str) -> tuple[Array | None, bool]:
    """The foremost known point of a foot, and whether it is the tip for certain."""
    for name, at_tip in (("toe_tip", True), ("toe", False)):
        if f"{side}_{name}" in skin:
            return skin[f"{side}_{name}"], at_tip
    knuckles = [skin[name] for name in (f"{side}_toe_medial", f"{side}_toe_lateral") if name in skin]
    return (np.mean(knuckles, axis=0), False) if len(knuckles) == 2 else (None, False)


def _heel(ankle: Array, toe: Array, left: Array, stature_m: float) -> Array:
    """A heel that nothing shows: behind the ankle on the sole, by the proportions of this body.

    Args:
        ankle: (T, 3).
        toe: (T, 3) tip of the foot, on the sole.
        left: (T, 3) from the right hip to the left one.
        stature_m: of the person.
    """
    foot = table("foot")
    reach = toe - ankle
    drop = np.minimum(float(foot["ankle"]) * stature_m, 0.9 * np.linalg.norm(reach, axis=-1, keepdims=True))
    along = vectors.unit(reach)
    above = np.cross(along, square(left, along))
    sine = drop / np.linalg.norm(reach, axis=-1, keepdims=True)
    cosine = np.sqrt(1 - sine**2)
    forward, up = cosine * along + sine * above, cosine * above - sine * along
    back = float(foot["behind"]) * np.linalg.norm(reach, axis=-1, keepdims=True) * cosine
    return np.asarray(ankle - back * forward - drop * up)


def _depth(ankle: Array, up: Array, stature_m: float) -> float:
    """How far the sole is below the line from heel to toe: what its ankle lacks in height above the line, m.

    Args:
        ankle: (T, 3) from the heel.
        up: (T, 3) square to that line.
        stature_m: of the person.
    """
    height = np.sum(ankle * up, axis=-1)
    if not np.isfinite(height).any():
        return 0.0
    foot = table("foot")
    lacks = float(foot["ankle"]) * stature_m - float(np.nanmedian(height))
    return float(np.clip(lacks, 0.0, float(foot["deepest"]) * stature_m))
