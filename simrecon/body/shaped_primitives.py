"""Primitives of a shape, placed on a kinematic tree that may have other lengths than the shape's own."""

from __future__ import annotations

from functools import cache

import numpy as np

from simrecon.body import mass, sizes
from simrecon.body.names import mirrored
from simrecon.body.primitives import entries
from simrecon.body.shape import space
from simrecon.body.shaped import Shape
from simrecon.body.skeleton import rescaled
from simrecon.types import Array, Primitive, Skeleton

FOOT_RATIO = (0.8, 1.3)
"""How far a foot is stretched to the length of another skeleton's foot."""
MIRROR = np.array([1.0, -1.0, 1.0])


def make(
    shape: Shape,
    skeleton: Skeleton,
    *,
    height_m: float,
    mass_kg: float,
    sole_m: float = 0.0,
    distribution: str = "standard",
) -> tuple[Primitive, ...]:
    """The primitives of a shape on a kinematic tree that may have other lengths than the shape's own.

    Limbs are stretched along their bones, the trunk along z, feet from heel to toe; all else, thickness too,
    follows stature.

    Args:
        shape: of the person.
        skeleton: with lengths in m.
        height_m: stature.
        mass_kg: of the whole person.
        sole_m: how far the sole lies below where heel and toe of the skeleton put it.
        distribution: of mass, by name (`mass.distribution`).

    Raises:
        InputError: there is no such distribution.
    """
    layout, scale = sizes.layout(), height_m / shape.height_m
    values = np.stack(
        [
            _placed(shape, skeleton, i, scale, sole_m if layout.names[i].endswith("_foot") else 0.0)
            for i in range(len(layout.names))
        ]
    )
    names, segments, kinds, both = both_sides(values)
    parts = {entry["name"]: entry["part"] for entry in entries()}
    shares = mass.shaped(
        [parts[name] for name in names], mass.volumes_m3(kinds, both), mass.volumes_m3(kinds, _mean_values())
    )
    shares = mass.spread(shares, segments, mass.distribution(distribution))
    masses = mass.printable(dict(zip(names, (mass_kg * shares).tolist(), strict=True)), mass_kg)
    return tuple(
        _primitive(name, segment, kind, row, masses[name])
        for name, segment, kind, row in zip(names, segments, kinds, both, strict=True)
    )


@cache
def _mean_values() -> Array:
    """Values (P, 9) of the mean shape of simrecon's space, which has de Leva's shares."""
    return both_sides(sizes.values(sizes.regress(np.zeros(space().size))))[3]


def both_sides(values: Array) -> tuple[list[str], list[str], list[str], Array]:
    """Names, segments, kinds and values (P, 9) of all primitives, in the order of `primitives.entries`."""
    layout = sizes.layout()
    names, segments, kinds, rows = [], [], [], []
    for name, segment, kind, row in zip(layout.names, layout.segments, layout.kinds, values, strict=True):
        for side in mirrored({"name": name, "segment": segment}):
            flip = MIRROR if side["name"].startswith("right_") else np.ones(3)
            names.append(side["name"])
            segments.append(side["segment"])
            kinds.append(kind)
            rows.append(np.concatenate((row[:3] * flip, row[3:6] * flip, row[6:])))
    return names, segments, kinds, np.stack(rows)


def _primitive(name: str, segment: str, kind: str, row: Array, mass_kg: float) -> Primitive:
    if kind == "box":
        return Primitive(name, segment, kind, row[None, :3], row[6:], mass_kg)
    return Primitive(name, segment, kind, row[:6].reshape(2, 3), row[6:7], mass_kg)


def _placed(shape: Shape, skeleton: Skeleton, i: int, scale: float, sole_m: float) -> Array:
    """Values (9,) of one primitive on the skeleton."""
    layout = sizes.layout()
    segment, row = layout.segments[i], shape.values[i] * scale
    own = rescaled(shape.skeleton, scale)
    child = {"spine": "chest", "chest": "neck", "left_shoulder": "left_elbow", "left_elbow": "left_wrist",
             "left_hip": "left_knee", "left_knee": "left_ankle"}.get(segment)  # fmt: skip
    if child is not None:
        bone = skeleton.names.index(child)
        axis = int(np.argmax(np.abs(own.offsets_m[bone])))
        stretch = np.ones(3)
        stretch[axis] = np.linalg.norm(skeleton.offsets_m[bone]) / np.linalg.norm(own.offsets_m[bone])
        row[:3], row[3:6] = row[:3] * stretch, row[3:6] * stretch
    elif layout.names[i].endswith("_foot"):
        row = _foot(row, own, skeleton, sole_m)
    return np.asarray(row)


def _foot(row: Array, own: Skeleton, skeleton: Skeleton, sole_m: float) -> Array:
    """The box of a foot between heel and toe of another skeleton, its sole as far below them as before."""

    def ends(tree: Skeleton) -> tuple[Array, Array]:
        at = tree.point_names.index
        return tree.point_offsets_m[at("left_heel")], tree.point_offsets_m[at("left_toe")]

    (heel, toe), (new_heel, new_toe) = ends(own), ends(skeleton)
    ratio = float(np.clip((new_toe[0] - new_heel[0]) / (toe[0] - heel[0]), *FOOT_RATIO))
    middle = 0.5 * (new_heel[0] + new_toe[0]) + ratio * (row[0] - 0.5 * (heel[0] + toe[0]))
    bottom = row[2] - row[8] + 0.5 * (new_heel[2] + new_toe[2] - heel[2] - toe[2]) - sole_m
    top = max(row[2] + row[8], bottom + 0.01)
    placed = row.copy()
    placed[0], placed[2], placed[6], placed[8] = (
        middle,
        0.5 * (top + bottom),
        row[6] * ratio,
        0.5 * (top - bottom),
    )
    return placed
