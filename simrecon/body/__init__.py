"""From measured lengths to a person that can be simulated: kinematic tree → primitives → MJCF."""

from __future__ import annotations

import numpy as np

from simrecon.body import mjcf, primitives
from simrecon.body.skeleton import (
    measure,
    measure_template,
    rescaled,
    scaled,
    stature_m,
    t_pose_m,
    template,
)
from simrecon.types import Body, Primitive, Skeleton

__all__ = [
    "Primitive",
    "build",
    "measure",
    "measure_template",
    "rescaled",
    "scaled",
    "stature_m",
    "t_pose_m",
    "template",
]


def build(skeleton: Skeleton, *, height_m: float, mass_kg: float, sole_m: float) -> Body:
    """A person on a given kinematic tree.

    Args:
        skeleton: with lengths in m.
        height_m: stature.
        mass_kg: of the whole person.
        sole_m: how far the sole lies below the heel and toe points.
    """
    parts = primitives.make(skeleton, height_m, mass_kg, sole_m)
    return Body(np.zeros(0), height_m, mass_kg, skeleton, parts, mjcf.make(skeleton, parts, mass_kg))
