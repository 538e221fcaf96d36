"""From measured lengths to a person that can be simulated: kinematic tree → primitives → MJCF."""

from __future__ import annotations

import numpy as np

from simrecon.body import mjcf, primitives, shaped, shaped_primitives
from simrecon.body.lengths import (
    bone_names,
    length_names,
    length_offsets,
    length_shares,
    measure,
    measure_template,
    scaled,
    stated_lengths,
)
from simrecon.body.shape import ShapeSpace
from simrecon.body.shaped import Shape, ShapeRequest
from simrecon.body.skeleton import rescaled, stature_m, t_pose_m, template
from simrecon.errors import InputError
from simrecon.types import Array, Body, Primitive, Skeleton

__all__ = [
    "Primitive",
    "Shape",
    "ShapeRequest",
    "bone_names",
    "build",
    "length_names",
    "length_offsets",
    "length_shares",
    "measure",
    "measure_template",
    "rescaled",
    "scaled",
    "stated_lengths",
    "stature_m",
    "t_pose_m",
    "template",
]


def build(
    skeleton: Skeleton | None = None,
    *,
    height_m: float | None = None,
    mass_kg: float | None = None,
    sole_m: float = 0.0,
    betas: Array | None = None,
    shapes: ShapeSpace | None = None,
    distribution: str = "standard",
) -> Body:
    """A person, on a kinematic tree of measured lengths, of shape parameters, or of both.

    Args:
        skeleton: with lengths in m; that of the shape, scaled to `height_m`, if None.
        height_m: stature; needed with a skeleton, otherwise that of the shape if None.
        mass_kg: of the whole person; needed without betas, otherwise volume times density if None.
        sole_m: how far the sole lies below the heel and toe points.
        betas: shape parameters, or None: primitives follow the proportions of `models/body/primitives.toml`.
        shapes: the space of the betas; that of simrecon if None.
        distribution: of mass, by name (`mass.distribution`).

    Raises:
        InputError: neither lengths nor betas, lengths without stature or mass, betas out of range, or no such
            distribution.
    """
    if betas is None:
        if skeleton is None or height_m is None or mass_kg is None:
            raise InputError("a body needs betas, or a skeleton with height_m and mass_kg")
        parts = primitives.make(skeleton, height_m, mass_kg, sole_m, distribution)
        return Body(np.zeros(0), height_m, mass_kg, skeleton, parts, mjcf.make(skeleton, parts, mass_kg))
    if skeleton is not None and height_m is None:
        raise InputError("a skeleton with betas needs height_m")
    shape = shaped.make(betas, height_m=height_m, shapes=shapes)
    tree, mass = skeleton or shape.skeleton, mass_kg or shape.mass_kg
    parts = shaped_primitives.make(
        shape, tree, height_m=shape.height_m, mass_kg=mass, sole_m=sole_m, distribution=distribution
    )
    return Body(
        shape.betas, shape.height_m, mass, tree, parts, mjcf.make(tree, parts, mass), shape.shapes.name
    )
