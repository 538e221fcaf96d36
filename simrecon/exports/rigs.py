"""The skeleton as a tree of joints with the names that other programs look for (`models/body/rigs.toml`)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from simrecon import resources
from simrecon.types import Array, Skeleton

BETWEEN, CLAVICLE = 0.5, 0.2
"""Of the way to the neck, where the upper chest is; of the breadth of a shoulder, where its clavicle is."""


@dataclass(frozen=True, eq=False)
class Joint:
    """One joint of a rig.

    Attributes:
        name: in the rig.
        parent: index, -1 for the root; parents come first, and what is below a joint follows it.
        segment: index of the segment whose orientation the joint has.
        turns: whether it has a rotation of its own; without, it goes with its parent.
        offset_m: (3,) from its parent, in the axes of the parent's segment.
        end_m: (3,) where its chain ends, in the axes of its segment; None: it goes on.
    """

    name: str
    parent: int
    segment: int
    turns: bool
    offset_m: Array
    end_m: Array | None = None


@cache
def _names(rig: str) -> dict[str, str]:
    table: dict[str, str] = resources.toml("models", "body", "rigs.toml")[rig]
    return table


def names(rig: str, segments: tuple[str, ...]) -> tuple[str, ...]:
    """What a rig calls the segments; as they are called here for `simrecon`, of which only BVH has a rig."""
    return segments if rig == "simrecon" else tuple(_named(name, _names(rig)) for name in segments)


def joints(skeleton: Skeleton, rig: str) -> tuple[Joint, ...]:
    """The joints of a rig on a skeleton, depth first.

    Args:
        skeleton: of the person.
        rig: a table of `rigs.toml`.
    """
    names, found, places = _names(rig), list[Joint](), list[Array]()

    def add(key: str, parent: int, place: Array, turns: bool) -> int:
        """A joint at a place in the axes of the segment that its parent goes with; its index."""
        offset = place - places[parent] if parent >= 0 else place
        segment = skeleton.names.index(_segment(key))
        found.append(Joint(_named(key, names), parent, segment, turns, offset, _end(skeleton, key)))
        places.append(np.zeros(3) if turns else place)
        return len(found) - 1

    def add_segment(segment: int, parent: int) -> None:
        key, place = skeleton.names[segment], skeleton.offsets_m[segment]
        if key.endswith("_shoulder") and "left_clavicle" in names:
            clavicle = key.replace("shoulder", "clavicle")
            parent = add(clavicle, parent, place * [1.0, CLAVICLE, 1.0], False)
        own = add(key, parent, place, True)
        if key == "chest" and "upper_chest" in names:
            own = add("upper_chest", own, BETWEEN * skeleton.offsets_m[skeleton.names.index("neck")], False)
        for child in np.flatnonzero(skeleton.parents == segment).tolist():
            add_segment(child, own)
        if key.endswith("_ankle"):
            add(key.replace("ankle", "toe"), own, _point(skeleton, key.replace("ankle", "mtp")), False)

    add_segment(0, -1)
    return tuple(found)


def _segment(key: str) -> str:
    """The segment whose orientation a joint has."""
    if key == "upper_chest" or key.endswith("_clavicle"):
        return "chest"
    return key.replace("_toe", "_ankle")


def _named(key: str, names: dict[str, str]) -> str:
    left = names[key.replace("right_", "left_", 1)]
    return left.replace("Left", "Right", 1) if key.startswith("right_") else left


def _end(skeleton: Skeleton, key: str) -> Array | None:
    """Where a chain ends: nose, knuckle of the index finger, tip of the toe."""
    side = key.partition("_")[0]
    if key == "head":
        return _point(skeleton, "nose")
    if key.endswith("_wrist"):
        return _point(skeleton, f"{side}_index")
    if key.endswith("_toe"):
        return _point(skeleton, key) - _point(skeleton, f"{side}_mtp")
    return None


def _point(skeleton: Skeleton, name: str) -> Array:
    offset: Array = skeleton.point_offsets_m[skeleton.point_names.index(name)]
    return offset
