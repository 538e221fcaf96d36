"""The kinematic tree: the template of unit stature, its T-pose and its height."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from simrecon import resources
from simrecon.body import names
from simrecon.geometry import rotations
from simrecon.types import Array, Skeleton

ROOT = "pelvis"


@cache
def joints() -> tuple[dict[str, Any], ...]:
    """The 16 joints of `models/body/skeleton.toml` on both sides, depth first as MuJoCo numbers them."""
    data = resources.toml("models", "body", "skeleton.toml")
    entries = [side for entry in data["joint"] for side in names.mirrored(entry)]

    def below(parent: str) -> list[dict[str, Any]]:
        children = [entry for entry in entries if entry["parent"] == parent]
        return [joint for child in children for joint in (child, *below(child["name"]))]

    return tuple(below(ROOT))


@cache
def template() -> Skeleton:
    """The skeleton of unit stature, before any length is measured."""
    order = (ROOT, *(joint["name"] for joint in joints()))
    index = {name: i for i, name in enumerate(order)}
    points = names.points()
    rest = np.array([[0.0, 0.0, 0.0]] + [joint["rest_deg"] for joint in joints()])
    return Skeleton(
        names=order,
        parents=np.array([-1] + [index[joint["parent"]] for joint in joints()]),
        offsets_m=np.array([[0.0, 0.0, 0.0]] + [joint["offset"] for joint in joints()]),
        rest=rotations.exp(np.radians(rest)),
        point_names=tuple(point["name"] for point in points),
        point_segments=np.array([index[point["segment"]] for point in points]),
        point_offsets_m=np.array([point["offset"] for point in points]),
        limits_rad=np.radians(np.array([joint["range_deg"] for joint in joints()], dtype=float)),
    )


def t_pose_m(skeleton: Skeleton) -> Array:
    """Joint centres (17, 3) in a T-pose with the pelvis at the origin."""
    origins = np.zeros_like(skeleton.offsets_m)
    for i, parent in enumerate(skeleton.parents):
        if parent >= 0:
            origins[i] = origins[parent] + skeleton.offsets_m[i]
    return origins


def stature_m(skeleton: Skeleton) -> float:
    """Height of a T-pose from the sole to the highest point of the head."""
    origins = t_pose_m(skeleton)

    def height_m(point: str) -> float:
        row = skeleton.point_names.index(point)
        return float(origins[skeleton.point_segments[row], 2] + skeleton.point_offsets_m[row, 2])

    return height_m("head_top") - height_m("left_heel")


def rescaled(skeleton: Skeleton, factor: float) -> Skeleton:
    """The skeleton with all lengths times `factor`."""
    return replace(
        skeleton,
        offsets_m=skeleton.offsets_m * factor,
        point_offsets_m=skeleton.point_offsets_m * factor,
    )
