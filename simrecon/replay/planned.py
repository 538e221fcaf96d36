"""Forces of a plan on the primitives of a body."""

from __future__ import annotations

import numpy as np

from simrecon.types import Array, Reference

LEAST_N = 1.0
"""A part that bears less has no centre of pressure: the forces of a plan are never quite zero."""


def loads(reference: Reference, parts: tuple[str, ...]) -> tuple[Array, Array]:
    """Force on each primitive and its place, (T, C, 3) each, of a plan with forces on points of them.

    The place is the mean of the points by the size of their forces; NaN where the primitive bears nothing.

    Args:
        reference: the plan.
        parts: C names of primitives.
    """
    force = np.zeros((len(reference.times_s), len(parts), 3))
    centre = np.full_like(force, np.nan)
    if reference.contact_force_N is None or reference.contact_place_m is None:
        return force, centre
    size = np.linalg.norm(reference.contact_force_N, axis=-1, keepdims=True)  # (T, P, 1)
    weight, moment = np.zeros((*force.shape[:2], 1)), np.zeros_like(force)
    for point, part in enumerate(reference.contact_parts):
        column = parts.index(part)
        force[:, column] += reference.contact_force_N[:, point]
        weight[:, column] += size[:, point]
        moment[:, column] += size[:, point] * reference.contact_place_m[:, point]
    np.divide(moment, weight, out=centre, where=weight > LEAST_N)
    return force, centre
