"""The parts of a body whose contact is told apart (`models/contact/parts.toml`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from simrecon import resources
from simrecon.body.names import mirrored
from simrecon.types import IntArray, Primitive

SIDES = ("left", "right")
HEELS, TOES = (tuple(f"{side}_{end}" for side in SIDES) for end in ("heel", "toe"))
SEAT = tuple(f"{side}_buttock" for side in SIDES)


@dataclass(frozen=True)
class Part:
    """One part.

    Attributes:
        name: of the part.
        at: primitives, and which of their points: `all`, `from`, `to`, `heel` or `toe`.
        points: of the body that tell whether the part is still.
        held: points by which a simulation is held to a wish of the part.
    """

    name: str
    at: Mapping[str, str]
    points: tuple[str, ...]
    held: tuple[str, ...]


@cache
def parts() -> tuple[Part, ...]:
    """All parts: left, right, centre."""
    entries = resources.toml("models", "contact", "parts.toml")["part"]
    sides = [side for entry in entries for side in mirrored(entry)]
    return tuple(
        Part(side["name"], _at(side), _points(side, "points"), _points(side, "held")) for side in sides
    )


def _at(entry: Mapping[str, Mapping[str, str]]) -> dict[str, str]:
    return {_sided(str(entry["name"]), name): which for name, which in entry["at"].items()}


def _points(entry: Mapping[str, Any], key: str) -> tuple[str, ...]:
    return tuple(_sided(str(entry["name"]), point) for point in entry[key])


def _sided(part: str, name: str) -> str:
    """The name on the side of the part: what a part of the right side has of the left is mirrored."""
    if part.startswith("right_") and name.startswith("left_"):
        return name.replace("left_", "right_", 1)
    if part.startswith("right_") and name.startswith("right_"):
        return name.replace("right_", "left_", 1)
    return name


def names() -> tuple[str, ...]:
    """Names of the parts."""
    return tuple(part.name for part in parts())


def rows(primitives: tuple[Primitive, ...], owner: tuple[str, ...]) -> tuple[IntArray, ...]:
    """Rows of the contact points of each part.

    Args:
        primitives: of the body.
        owner: (G,) primitive of each contact point; ends of a capsule and corners of a box in the order of
            `kinematics.contacts.contact_points`: the lower sign of x, then of y, then of z first.
    """
    found = np.array(owner)
    kinds = {part.name: part.kind for part in primitives}
    own = {name: np.flatnonzero(found == name) for name in kinds}
    return tuple(
        np.concatenate([own[name][_which(kinds[name], which)] for name, which in part.at.items()])
        for part in parts()
    )


def _which(kind: str, which: str) -> slice | list[int]:
    if which == "all":
        return slice(None)
    corners = {"heel": [0, 2], "toe": [4, 6]}  # those at the sole: the lower z
    return corners[which] if kind == "box" else {"from": [0], "to": [1]}[which]
