"""The skin of a posed body: linear blend skinning of a shape's vertices, for display and contact."""

from __future__ import annotations

import numpy as np

from simrecon.body.shape import ShapeSpace
from simrecon.types import Array, IntArray


def posed(
    shapes: ShapeSpace,
    betas: Array,
    origins_m: Array,
    axes: Array,
    *,
    scale: float = 1.0,
    rows: IntArray | None = None,
) -> Array:
    """Places of the skin's vertices on posed segments.

    v = Σ_s w_s (R_s R_s⁰ᵀ c (v⁰ - o_s⁰) + o_s) with weights w, the relaxed stance ⁰ and scale c.

    Args:
        shapes: the shape space.
        betas: (B,) of the body.
        origins_m: (..., 17, 3) of the segments in the world.
        axes: (..., 17, 3, 3) of the segments in the world.
        scale: of the body over the shape: its stature over `shape.stature_m`.
        rows: which vertices, all if None.

    Returns:
        (..., V, 3) m, or as many as `rows`.
    """
    chosen = np.arange(len(shapes.weights)) if rows is None else rows
    relaxed_origins, relaxed_axes = shapes.frames(betas)  # (17, 3), (17, 3, 3)
    skin = shapes.vertices_m(betas)[chosen]  # (V, 3)
    turn = scale * axes @ np.swapaxes(relaxed_axes, -1, -2)  # (..., 17, 3, 3)
    shift = origins_m - np.einsum("...sij,sj->...si", turn, relaxed_origins)  # (..., 17, 3)
    weights = shapes.weights[chosen]  # (V, 17)
    blended = np.tensordot(weights, turn, axes=(1, turn.ndim - 3))  # (V, ..., 3, 3)
    moved = np.einsum("v...ij,vj->v...i", blended, skin) + np.tensordot(
        weights, shift, axes=(1, shift.ndim - 2)
    )
    return np.asarray(np.moveaxis(moved, 0, -2))
