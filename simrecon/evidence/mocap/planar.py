"""A person seen from one side (Sports2D, Pose2Sim with one camera): points in a plane, without depth.

Sports2D writes zero, or a constant of its own for each keypoint (`[sports2d]`), for the third coordinate. The
breadth of hips and shoulders then comes from proportions, as far as the plane does not show it: of a person
seen from the side all of it, of one seen from the front nothing.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from simrecon.evidence.mocap.labels import table
from simrecon.evidence.mocap.size import SIDES
from simrecon.types import Array

FLAT_M = 1e-3
"""No two points differ by more along an axis that has no depth, and each constant is met as closely."""
CONSTANTS_MIN = 4


def depth_axis(points: Mapping[str, Array]) -> int | None:
    """The level axis along which nothing is known, 0 or 1, or None.

    Args:
        points: (T, 3) by name, world, z up, m.
    """
    for axis in (0, 1):
        values = {name: place[:, axis] for name, place in points.items()}
        known = np.concatenate([value[np.isfinite(value)] for value in values.values()])
        if np.ptp(known) < FLAT_M or _of_sports2d(values):
            return axis
    return None


def _of_sports2d(values: Mapping[str, Array]) -> bool:
    """Whether coordinates (T,) by point are the constants that Sports2D writes."""
    constants = table("sports2d")
    met = 0
    for name, value in values.items():
        side, _, joint = name.partition("_")
        if side not in SIDES or joint not in constants or not np.isfinite(value).any():
            continue
        if np.nanmax(np.abs(np.abs(value) - float(constants[joint]))) > FLAT_M:
            return False
        met += 1
    return met >= CONSTANTS_MIN


def with_depth(centre: dict[str, Array], surface: dict[str, Array], axis: int, stature_m: float) -> str:
    """Give points a depth by proportions; a note for the reading.

    Args:
        centre: joints by name, (T, 3) in the world, z up, m; they are replaced.
        surface: points of the feet by name, likewise.
        axis: that has no depth, 0 or 1.
        stature_m: of the person.
    """
    shown = 1 - axis  # the level axis that the plane shows
    # right of one who looks along +x is -y, of one who looks along +y it is +x
    right = (-1.0 if shown == 0 else 1.0) * _facing(centre, surface, shown)
    shares = table("planar")
    unseen = _unseen(centre, "hip", shown, float(shares["hip"]) * stature_m)
    for points in (centre, surface):
        for name, place in points.items():
            side, _, joint = name.partition("_")
            depth = 0.0
            if joint in shares and side in SIDES:
                wide = float(shares[joint]) * stature_m
                share = _unseen(centre, joint, shown, wide) if joint == "shoulder" else unseen
                depth = 0.5 * wide * share * right * (1.0 if side == "right" else -1.0)
            points[name] = place.copy()
            points[name][:, axis] = depth + 0.0 * place[:, axis]
    return f"a plane without depth along {'xy'[axis]}: breadth of hips and shoulders from proportions"


def _unseen(points: Mapping[str, Array], joint: str, shown: int, wide: float) -> float:
    """Share of a pair's breadth that the plane does not show: 1 from the side, 0 from the front."""
    left, right = (points[f"{side}_{joint}"][:, shown] for side in SIDES)
    apart = np.abs(left - right)
    seen = float(np.nanmedian(apart)) if np.isfinite(apart).any() else 0.0
    return float(np.sqrt(max(1.0 - (seen / wide) ** 2, 0.0)))


def _facing(centre: Mapping[str, Array], surface: Mapping[str, Array], shown: int) -> float:
    """Which way along the shown axis the person looks: as the feet point, or as it walks; 1 or -1."""
    ahead = [
        surface[f"{side}_{front}"] - centre[f"{side}_ankle"]
        for side in SIDES
        for front in ("toe_tip", "toe")
        if f"{side}_{front}" in surface
    ]
    if not ahead:
        ahead = [np.diff((centre["left_hip"] + centre["right_hip"]) / 2, axis=0)]
    steps = np.concatenate([step[:, shown] for step in ahead])
    return -1.0 if np.isfinite(steps).any() and np.nanmedian(steps) < 0 else 1.0
