"""A person as a tree of segments with primitives."""

from __future__ import annotations

from dataclasses import dataclass

from simrecon.types.arrays import Array, IntArray


@dataclass(frozen=True, eq=False)
class Primitive:
    """One rigid shape of the body.

    Attributes:
        name: unique among the primitives.
        segment: the body it is part of: `pelvis` or the name of a joint.
        kind: `capsule` (two end points and a radius) or `box` (centre and half sizes, axes of the segment).
        points_m: capsule (2, 3) end points, box (1, 3) centre, in the frame of the segment.
        size_m: capsule (1,) radius, box (3,) half sizes.
        mass_kg: its share of the body mass.
    """

    name: str
    segment: str
    kind: str
    points_m: Array
    size_m: Array
    mass_kg: float


@dataclass(frozen=True, eq=False)
class Skeleton:
    """The kinematic tree: a free pelvis and 16 ball joints; every joint carries the segment of its name.

    World rotation of segment b: R_b = R_parent · rest_b · q_b, with q_b the joint's rotation in `qpos`;
    its origin: o_b = o_parent + R_parent · offset_b.

    Attributes:
        names: 17 segment names, `pelvis` first, parents before children; names[1:] are also the joint names.
        parents: (17,) index of the parent, -1 for the pelvis.
        offsets_m: (17, 3) joint centre in the parent's frame; the pelvis' row is zero.
        rest: (17, 4) orientation of the segment in its parent's frame at the centre of the joint's range.
        point_names: names of the landmark points (28 of the core paper, then further joint centres).
        point_segments: (M,) segment index of each point.
        point_offsets_m: (M, 3) in the frame of the segment.
        limits_rad: (16, 3, 2) range of each component of the joint's rotation vector.
    """

    names: tuple[str, ...]
    parents: IntArray
    offsets_m: Array
    rest: Array
    point_names: tuple[str, ...]
    point_segments: IntArray
    point_offsets_m: Array
    limits_rad: Array


@dataclass(frozen=True, eq=False)
class Body:
    """A person: kinematic tree, primitives, mass, and the MJCF made of them (the person alone, no scene).

    Attributes:
        betas: (B,) shape parameters, none if the shape is not parametric.
        height_m: stature.
        mass_kg: of the whole person.
        skeleton: the kinematic tree.
        primitives: its rigid shapes.
        mjcf: the model of both.
        shape_space: name of the space of the betas: `simrecon`, or the file of a body model; empty without.
    """

    betas: Array
    height_m: float
    mass_kg: float
    skeleton: Skeleton
    primitives: tuple[Primitive, ...]
    mjcf: str
    shape_space: str = ""
