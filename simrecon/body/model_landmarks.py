"""Landmarks on a body model that has none: placed in each segment as on simrecon's own mean shape."""

from __future__ import annotations

import numpy as np
import scipy

from simrecon.body import shape
from simrecon.body.frames import segment_frames
from simrecon.body.shape import HEAD_POINT
from simrecon.body.skeleton import template
from simrecon.types import Array

SOLE_VERTICES = 0.02
"""Share of a foot's vertices whose mean is the sole: the lowest ones."""
NEAR_VERTICES = 12
"""Number of vertices whose weighted mean a landmark is."""


def place(mean_m: Array, rows: Array, weights: Array) -> tuple[tuple[str, ...], Array]:
    """Points on a body model: joint centres, landmarks, crown and soles, as on simrecon's own mean shape.

    Args:
        mean_m: (V, 3) vertices of the mean shape.
        rows: (17, V) maps from vertices to our joint centres.
        weights: (V, 17) skinning weights by our segments.

    Returns:
        Names (M,), and maps (M, V) from vertices to points.
    """
    own = shape.space()
    zero = np.zeros(own.size)
    names, labels = template().names, weights.argmax(axis=1)
    own_skin, own_points, own_labels = own.vertices_m(zero), own.points_m(zero), own.weights.argmax(axis=1)
    origins = rows @ mean_m
    at = _with_rough_feet(dict(zip(names, origins, strict=True)))
    own_origins, own_axes = own.frames(zero)
    maps: dict[str, Array] = {}
    # Feet and hands first: they turn the frames in which their other points are placed.
    first = [f"{side}_{end}" for side in ("left", "right") for end in ("heel", "toe", "index", "pinky")]
    for name in (*(4 * first), *(name for name in own.point_names if name not in first)):
        axes = segment_frames(names, at)
        if name in names or name == HEAD_POINT:
            continue
        segment = names.index(_segment_of(name))
        here = np.flatnonzero(labels == segment)
        local = (mean_m[here] - origins[segment]) @ axes[segment]
        row = np.zeros(len(mean_m))
        if name.endswith("_sole"):
            row[here[np.argsort(local[:, 2])[: max(1, round(SOLE_VERTICES * len(here)))]]] = 1.0
        else:
            theirs = (own_skin[own_labels == segment] - own_origins[segment]) @ own_axes[segment]
            low, size = theirs.min(axis=0), np.ptp(theirs, axis=0)
            share = ((own_points[name] - own_origins[segment]) @ own_axes[segment] - low) / size
            target = local.min(axis=0) + share * np.ptp(local, axis=0)
            near = here[scipy.spatial.cKDTree(local).query(target, k=min(NEAR_VERTICES, len(here)))[1]]
            row[near] = _weights(mean_m[near], origins[segment] + axes[segment] @ target)
        maps[name] = row / row.sum()
        at[name] = maps[name] @ mean_m
    return (*names, *maps), np.stack((*rows, *maps.values()))


def _weights(corners_m: Array, target_m: Array) -> Array:
    """The smallest weights (n,) of points (n, 3), sum 1, whose mean is the target, or as near as can be."""
    centre = corners_m.mean(axis=0)
    moved: Array = np.linalg.pinv(corners_m - centre).T @ (target_m - centre)
    return np.asarray(moved - moved.mean() + 1.0 / len(corners_m))


def _with_rough_feet(at_m: dict[str, Array]) -> dict[str, Array]:
    """Joint centres, and heels and toes that let the feet point forward, to begin with."""
    for side in ("left", "right"):
        at_m[f"{side}_heel"], at_m[f"{side}_toe"] = np.zeros(3), np.array([1.0, 0.0, 0.0])
    return at_m


def _segment_of(point: str) -> str:
    unit = template()
    if point in unit.point_names:
        return str(unit.names[unit.point_segments[unit.point_names.index(point)]])
    return "head" if point == "crown" else point.replace("_sole", "_ankle")
