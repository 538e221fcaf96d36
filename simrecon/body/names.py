"""Which point of the body a landmark or joint name of the evidence means (`models/body/landmarks.toml`)."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Any

import numpy as np

from simrecon import resources
from simrecon.types import Array, IntArray

IGNORED = -1


@cache
def points() -> tuple[dict[str, Any], ...]:
    """The points of the body, left, right and centre: `name`, `segment`, `offset` (fractions of stature).

    The 28 landmarks of Gärtner 2022 come first, then further joint centres.
    """
    data = resources.toml("models", "body", "landmarks.toml")
    return tuple(side for entry in data["landmark"] + data["centre"] for side in mirrored(entry))


def point_weights() -> Array:
    """Weights (M,) of the points in the loss of a rollout."""
    return np.array([point.get("weight", 1.0) for point in points()])


@cache
def landmark_count() -> int:
    """How many of `points` are landmarks."""
    data = resources.toml("models", "body", "landmarks.toml")
    return sum(len(mirrored(entry)) for entry in data["landmark"])


def mirrored(entry: dict[str, Any]) -> tuple[dict[str, Any], ...]:
    """An entry and, where its name starts with `left_`, its mirror image in the plane y = 0."""
    if not entry["name"].startswith("left_"):
        return (entry,)
    other = {key: _mirror(key, value) for key, value in entry.items()}
    return entry, other


def _mirror(key: str, value: Any) -> Any:
    if isinstance(value, str):
        return value.replace("left_", "right_", 1) if value.startswith("left_") else value
    if key in ("offset", "from", "to", "centre"):
        return [value[0], -value[1], value[2]]
    if key == "rest_deg":
        return [-value[0], value[1], -value[2]]
    if key == "range_deg":
        return [[-value[0][1], -value[0][0]], value[1], [-value[2][1], -value[2][0]]]
    return value


@cache
def _lookup() -> dict[str, int]:
    data = resources.toml("models", "body", "landmarks.toml")
    index = {point["name"]: i for i, point in enumerate(points())}
    lookup = dict(index)
    for table in data["names"].values():
        for alias, name in table.items():
            lookup[alias.lower()] = index[name]
            for left, right in (("left", "right"), ("L", "R"), ("_l", "_r")):
                if name.startswith("left_") and left in alias:
                    lookup[alias.replace(left, right, 1).lower()] = index[name.replace("left", "right", 1)]
                    break
    return lookup | {name.lower(): IGNORED for name in data["ignored"]["names"]}


def valid_names() -> tuple[str, ...]:
    """All names that evidence may use, in lower case, sorted."""
    return tuple(sorted(_lookup()))


def resolve(names: Iterable[str]) -> IntArray:
    """Index into `points` of each name, `IGNORED` for a known name without a fixed place on the body.

    Raises:
        KeyError: a name is not among `valid_names`.
    """
    lookup = _lookup()
    return np.array([lookup[name.lower()] for name in names], dtype=np.int64)
