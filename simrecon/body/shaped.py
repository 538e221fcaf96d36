"""A person of a given shape: kinematic tree and primitives of shape parameters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np

from simrecon.body import fitting, mass, shape, sizes
from simrecon.body.names import mirrored
from simrecon.body.primitives import entries
from simrecon.body.shape import ShapeSpace
from simrecon.body.skeleton import rescaled
from simrecon.types import Array, Primitive, Skeleton

FOOT_RATIO = (0.8, 1.3)
"""How far a foot is stretched to the length of another skeleton's foot."""
MIRROR = np.array([1.0, -1.0, 1.0])


@dataclass(frozen=True, eq=False)
class Shape:
    """A body shape, ready to be built. E primitives of the left side and the centre.

    Attributes:
        shapes: the space of its parameters; betas: (B,).
        skeleton: lengths in m.
        values: (E, 9) of the primitives, see `sizes.VALUES`.
        height_m: stature.
        volume_m3: of the body.
    """

    shapes: ShapeSpace
    betas: Array
    skeleton: Skeleton
    values: Array
    height_m: float
    volume_m3: float

    @property
    def mass_kg(self) -> float:
        """Volume times the density of `models/body/mass.toml`."""
        return self.volume_m3 * mass.density_kgpm3()


@dataclass(frozen=True, eq=False)
class Wanted:
    """What a run is told of the body's shape.

    Attributes:
        betas: shape parameters, or None: those that lengths, height and mass make most probable
            (`shape.fit`).
        shapes: their space; that of simrecon if None.
        distribution: of mass, by name (`mass.distribution`).
    """

    betas: Array | None = None
    shapes: ShapeSpace | None = None
    distribution: str = "standard"


def make(betas: Array, *, height_m: float | None = None, shapes: ShapeSpace | None = None) -> Shape:
    """The body of some shape parameters.

    Primitives come from the regressor where it knows the shape space, and from a fit to the skin (some
    seconds) where the user brought a body model.

    Args:
        betas: up to B numbers, the rest are zero.
        height_m: stature to which the whole is scaled; that of the shape if None.
        shapes: the shape space; that of simrecon if None.

    Raises:
        InputError: see `shape.check`.
    """
    shapes = shapes or shape.space()
    betas = shape.check(betas, shapes)
    own = shapes is shape.space()
    psi = sizes.regress(betas) if own else _fitted(shapes, tuple(betas.tolist()))
    own_m = shape.stature_m(betas, shapes)
    scale = 1.0 if height_m is None else height_m / own_m
    return Shape(
        shapes,
        betas,
        rescaled(shape.skeleton(betas, shapes), scale),
        sizes.values(psi) * scale,
        own_m * scale,
        shapes.volume_m3(betas) * scale**3,
    )


@lru_cache(maxsize=16)
def _fitted(shapes: ShapeSpace, betas: tuple[float, ...]) -> Array:
    """Sizes ψ of a shape by direct fit; a run asks for the same one more than once."""
    given = np.array(betas)
    return fitting.fit(fitting.targets(shapes, given), fitting.start(shape.stature_m(given, shapes)))


def primitives(
    made: Shape,
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
        made: the shape.
        skeleton: with lengths in m.
        height_m: stature.
        mass_kg: of the whole person.
        sole_m: how far the sole lies below where heel and toe of the skeleton put it.
        distribution: of mass, by name (`mass.distribution`).

    Raises:
        InputError: there is no such distribution.
    """
    layout, scale = sizes.layout(), height_m / made.height_m
    values = np.stack(
        [
            _placed(made, skeleton, i, scale, sole_m if layout.names[i].endswith("_foot") else 0.0)
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
    return both_sides(sizes.values(sizes.regress(np.zeros(shape.space().size))))[3]


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


def _placed(made: Shape, skeleton: Skeleton, i: int, scale: float, sole_m: float) -> Array:
    """Values (9,) of one primitive on the skeleton."""
    layout = sizes.layout()
    segment, row = layout.segments[i], made.values[i] * scale
    own = rescaled(made.skeleton, scale)
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
