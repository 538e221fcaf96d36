"""Shapes that stand for a mesh: a convex hull, convex parts, or a height field."""

from __future__ import annotations

import importlib
from dataclasses import dataclass

import numpy as np
import scipy

from simrecon.types import Array, IntArray

MAX_TRIANGLES = 20_000
"""A mesh of more triangles is simplified before it is cut into parts or sampled."""
HULL_VERTICES = 64
"""Most vertices of a convex part; of more, those farthest in as many directions are kept."""
_SEED = 0


@dataclass(frozen=True, eq=False)
class Field:
    """Heights over a rectangle.

    Attributes:
        centre_m, half_m: (3,) centre and half sizes of the bounds.
        heights_m: (R, C) above the lowest point, rows along y, columns along x.
    """

    centre_m: Array
    half_m: Array
    heights_m: Array


def simplified(vertices: Array, faces: IntArray) -> tuple[Array, IntArray]:
    """A mesh of at most `MAX_TRIANGLES`: vertices are merged in cubes that grow until there are few enough.

    Args:
        vertices: (V, 3).
        faces: (F, 3).

    Returns:
        Fewer vertices and faces; the mesh itself if it is small enough.
    """
    cell = float(np.ptp(vertices, axis=0).max()) / 400
    merged, kept = vertices, faces
    while len(kept) > MAX_TRIANGLES:
        keys = np.round(vertices / cell).astype(np.int64)
        cluster = np.unique(keys, axis=0, return_inverse=True)[1]
        count = np.bincount(cluster.ravel())
        merged = np.stack([np.bincount(cluster.ravel(), column) / count for column in vertices.T], axis=1)
        kept = cluster.ravel()[faces]
        flat = (kept[:, 0] == kept[:, 1]) | (kept[:, 1] == kept[:, 2]) | (kept[:, 2] == kept[:, 0])
        kept = np.unique(kept[~flat], axis=0)
        cell *= 1.3
    return merged, kept


def hull_points(points: Array) -> Array:
    """At most `HULL_VERTICES` of the points (V, 3), those farthest out, whose hull is nearly that of all."""
    hull = points[scipy.spatial.ConvexHull(points).vertices]
    if len(hull) <= HULL_VERTICES:
        return np.asarray(hull)
    # a Fibonacci lattice on the sphere
    k = np.arange(HULL_VERTICES) + 0.5
    z, turn = 1 - 2 * k / HULL_VERTICES, np.pi * (1 + np.sqrt(5)) * k
    directions = np.stack((np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z), axis=1)
    middle, size = hull.mean(axis=0), np.maximum(np.ptp(hull, axis=0), 1e-9)
    return np.asarray(hull[np.unique(np.argmax(((hull - middle) / size) @ directions.T, axis=0))])


def convex_parts(vertices: Array, faces: IntArray, most: int) -> tuple[Array, ...]:
    """Vertices (V, 3) of at most `most` convex parts: CoACD (Wei et al., SIGGRAPH 2022)."""
    coacd = importlib.import_module("coacd")  # an extra
    coacd.set_log_level("error")
    parts = coacd.run_coacd(
        coacd.Mesh(vertices, faces), max_convex_hull=most, seed=_SEED, max_ch_vertex=HULL_VERTICES
    )
    return tuple(hull_points(np.asarray(points, float)) for points, _ in parts)


def height_field(vertices: Array, faces: IntArray, cells: int) -> Field:
    """The highest surface over a grid: every triangle is rasterised.

    Args:
        vertices: (V, 3) in metres.
        faces: (F, 3).
        cells: along the longer side.
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    size = high - low
    edge = max(size[0], size[1]) / cells
    columns, rows = (max(2, int(np.ceil(length / edge)) + 1) for length in size[:2])
    x, y = np.linspace(low[0], high[0], columns), np.linspace(low[1], high[1], rows)
    heights = np.zeros((rows, columns))
    for corners in vertices[faces]:  # (3, 3)
        inside = [
            slice(*np.searchsorted(axis, [corners[:, i].min() - 1e-9, corners[:, i].max() + 1e-9]))
            for i, axis in enumerate((x, y))
        ]
        gx, gy = np.meshgrid(x[inside[0]], y[inside[1]])
        side = corners[1:, :2] - corners[0, :2]
        area = side[0, 0] * side[1, 1] - side[0, 1] * side[1, 0]
        if not gx.size or abs(area) < 1e-15:
            continue
        dx, dy = gx - corners[0, 0], gy - corners[0, 1]
        u, v = (dx * side[1, 1] - dy * side[1, 0]) / area, (dy * side[0, 0] - dx * side[0, 1]) / area
        z = corners[0, 2] + u * (corners[1, 2] - corners[0, 2]) + v * (corners[2, 2] - corners[0, 2])
        hit = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9)
        patch = heights[inside[1], inside[0]]
        np.maximum(patch, np.where(hit, z, 0.0), out=patch)
    return Field((low + high) / 2, size / 2, heights)
