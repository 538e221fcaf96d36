"""One solid part of an item.

The item's frame has its origin at the centre of the footprint, at the lowest height, and z up.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy

from simrecon.types import Array, IntArray

Shape = Literal["box", "sphere", "hull", "field"]


@dataclass(frozen=True, eq=False)
class Part:
    """One solid shape, convex unless it is a height field.

    Attributes:
        name: within its item; empty where it is the only part.
        shape: `box`, `sphere`, `hull` (of vertices) or `field` (heights over a rectangle).
        centre_m: (3,) of the box, the sphere, the hull's bounds or the field's bounds.
        half_m: (3,) half sizes of the box or the bounds; of a sphere its radius, three times.
        deep: to the kinematic fit the part goes down without end, so that nothing gets under it.
        vertices_m: (V, 3) of a hull; faces: (F, 3) its triangles, counter-clockwise seen from outside.
        heights_m: (R, C) of a field above `centre_m[2] - half_m[2]`, rows along y, columns along x.
    """

    name: str
    shape: Shape
    centre_m: Array
    half_m: Array
    deep: bool = False
    vertices_m: Array | None = None
    faces: IntArray | None = None
    heights_m: Array | None = None

    @property
    def volume_m3(self) -> float:
        """Volume of the shape; a height field counts as its bounding box."""
        if self.shape == "sphere":
            return float(4 / 3 * np.pi * self.half_m[0] ** 3)
        if self.shape == "hull" and self.vertices_m is not None:
            return float(scipy.spatial.ConvexHull(self.vertices_m).volume)
        return float(8 * np.prod(self.half_m))


def block(name: str, low_m: tuple[float, ...], high_m: tuple[float, ...], deep: bool = False) -> Part:
    """A box between two opposite corners, (3,) each."""
    first, last = np.array(low_m, float), np.array(high_m, float)
    return Part(name, "box", (first + last) / 2, (last - first) / 2, deep)


def standing(length_m: float, width_m: float, height_m: float) -> Part:
    """A box on the origin that is the only part of its item; nothing gets under it."""
    half = np.array([length_m / 2, width_m / 2, height_m / 2])
    return Part("", "box", np.array([0.0, 0.0, height_m / 2]), half, True)


def hull(name: str, points_m: Array) -> Part:
    """The convex hull of points (N, 3), with outward triangles and only the vertices that it needs."""
    convex = scipy.spatial.ConvexHull(points_m)
    vertices = np.unique(convex.simplices)
    place = np.full(len(points_m), -1)
    place[vertices] = np.arange(len(vertices))
    corners = points_m[convex.simplices]  # (F, 3, 3)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward = np.einsum("fi,fi->f", normal, convex.equations[:, :3]) > 0
    faces = np.where(outward[:, None], convex.simplices, convex.simplices[:, ::-1])
    low, high = points_m.min(axis=0), points_m.max(axis=0)
    return Part(
        name,
        "hull",
        (low + high) / 2,
        (high - low) / 2,
        False,
        points_m[vertices],
        place[faces].astype(np.int64),
    )
