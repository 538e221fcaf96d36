"""Spheres that stand for the body where it may touch the scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon.types import Array, IntArray, Primitive, Skeleton


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """Spheres that stand for the primitives where they may touch the scene.

    Attributes:
        segments: (G,); offsets_m: (G, 3); radii_m: (G,).
        drop: (G, 3) how the point moves as the sole goes down by a metre.
        mass_share: (G,) weights whose mean of the points is the centre of mass.
        soles: (2, 4) rows of the corners of the left and the right sole.
    """

    segments: IntArray
    offsets_m: Array
    radii_m: Array
    drop: Array
    mass_share: Array
    soles: IntArray


def contact_points(skeleton: Skeleton, primitives: tuple[Primitive, ...]) -> ContactPoints:
    """Ends of the capsules and corners of the boxes; `primitives` made with sole_m = 0."""
    segments, offsets, radii, sole, owner, mass = [], [], [], [], [], []
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    for part in primitives:
        capsule = part.kind == "capsule"
        places = part.points_m if capsule else part.points_m + signs * part.size_m
        for place in places:
            segments.append(skeleton.names.index(part.segment))
            offsets.append(place)
            radii.append(part.size_m[0] if capsule else 0.0)
            sole.append(float(part.name.endswith("_foot")))
            owner.append(part.name)
            mass.append(part.mass_kg / len(places))
    parts = np.array(owner)
    drop = np.outer(sole, [0.0, 0.0, -1.0])
    # corners with the lower sign of z come first in every pair
    soles = np.array([np.flatnonzero(parts == f"{side}_foot")[::2] for side in ("left", "right")])
    return ContactPoints(
        np.array(segments),
        np.array(offsets),
        np.array(radii),
        drop,
        np.array(mass) / sum(mass),
        soles,
    )
