"""Distance to one solid part, and the height of its upper side."""

from __future__ import annotations

import functools

import numpy as np
import scipy

from simrecon.scene.parts import Part
from simrecon.types import Array

# Beyond this distance from the bounds of a hull, the distance to its bounding sphere is good enough.
_NEAR_M = 0.3


def distance(part: Part, local_m: Array) -> tuple[Array, Array]:
    """Signed distance of points to a part, negative inside, and its gradient.

    Args:
        part: of an item.
        local_m: (..., 3) from the part's centre, or from the middle of a deep part's top.

    Returns:
        (...) distances in metres and (..., 3) unit gradients.
    """
    if part.shape == "sphere":
        far = np.linalg.norm(local_m, axis=-1)
        return far - part.half_m[0], local_m / np.maximum(far, 1e-12)[..., None]
    if part.shape == "hull":
        return _to_hull(part, local_m)
    if part.shape == "field":
        return _to_field(part, local_m)
    return _to_box(part, local_m)


def _to_box(part: Part, local: Array) -> tuple[Array, Array]:
    sign = np.where(local < 0, -1.0, 1.0)
    half = part.half_m
    if part.deep:
        sign = sign * [1.0, 1.0, 0.0] + [0.0, 0.0, 1.0]
        half = half * [1.0, 1.0, 0.0]
    beyond = local * sign - half  # (..., 3) distance past each face
    outside = np.maximum(beyond, 0.0)
    far = np.linalg.norm(outside, axis=-1)
    nearest = np.argmax(beyond, axis=-1)
    inward = sign * np.eye(3)[nearest]
    outward = sign * outside / np.maximum(far, 1e-12)[..., None]
    return np.where(far > 0, far, beyond.max(axis=-1)), np.where(far[..., None] > 0, outward, inward)


def _to_hull(part: Part, local: Array) -> tuple[Array, Array]:
    radius = float(np.linalg.norm(part.half_m))
    far = np.asarray(np.linalg.norm(local, axis=-1))
    apart, gradient = np.array(far - radius), local / np.maximum(far, 1e-12)[..., None]
    near = apart < _NEAR_M
    planes = _planes(part)  # (F, 4) about the centre
    heights = local[near] @ planes[:, :3].T + planes[:, 3]  # (n, F)
    face = np.argmax(heights, axis=-1)
    apart[near], gradient[near] = heights.max(axis=-1), planes[face, :3]
    return apart, gradient


def _to_field(part: Part, local: Array) -> tuple[Array, Array]:
    """Distance from a field's surface along its slope; points count from the middle of the highest level."""
    heights = _field_heights(part)
    rows, columns = heights.shape
    step = 2 * part.half_m[:2] / [columns - 1, rows - 1]
    place = np.clip((local[..., :2] + part.half_m[:2]) / step, 0, [columns - 1.001, rows - 1.001])
    cell = place.astype(np.int64)
    u, v = np.moveaxis(place - cell, -1, 0)
    i, j = cell[..., 1], cell[..., 0]
    a, b, c, d = heights[i, j], heights[i, j + 1], heights[i + 1, j], heights[i + 1, j + 1]
    surface = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d)
    slope = np.stack(
        (((1 - v) * (b - a) + v * (d - c)) / step[0], ((1 - u) * (c - a) + u * (d - b)) / step[1])
    )
    normal = np.stack((-slope[0], -slope[1], np.ones_like(u)), axis=-1)
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    over = (local[..., 2] - surface + 2 * part.half_m[2]) / length[..., 0]
    block = Part("", "box", part.centre_m, part.half_m, True)
    beside, sideways = _to_box(block, local)
    out = np.asarray((np.abs(local[..., :2]) > part.half_m[:2]).any(axis=-1))
    return np.where(out, beside, over), np.where(out[..., None], sideways, normal / length)


def _field_heights(part: Part) -> Array:
    return np.zeros((2, 2)) if part.heights_m is None else part.heights_m


def top(part: Part, local_xy: Array) -> Array:
    """Height of a part's upper side.

    Args:
        part: of an item.
        local_xy: (..., 2) places in metres from the part's centre, seen from above.

    Returns:
        (...) heights over the item's origin in metres, minus infinity beside the part.
    """
    middle = float(part.centre_m[2])
    inside = (np.abs(local_xy) <= part.half_m[:2]).all(axis=-1)  # (...)
    if part.shape == "box":
        return np.where(inside, middle + part.half_m[2], -np.inf)
    if part.shape == "sphere":
        rest = part.half_m[0] ** 2 - np.sum(local_xy**2, axis=-1)
        return np.where(rest >= 0, middle + np.sqrt(np.maximum(rest, 0.0)), -np.inf)
    if part.shape == "field":
        local = np.concatenate((local_xy, np.zeros((*local_xy.shape[:-1], 1))), axis=-1)
        apart, gradient = _to_field(part, local)
        return np.where(inside, middle + part.half_m[2] - apart / gradient[..., 2], -np.inf)
    planes = _planes(part)
    level = local_xy @ planes[:, :2].T + planes[:, 3]  # (..., F)
    rising = planes[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        height = -level / rising
    high = np.min(np.where(rising > 1e-9, height, np.inf), axis=-1)
    low = np.max(np.where(rising < -1e-9, height, -np.inf), axis=-1)
    beside = (np.where(np.abs(rising) <= 1e-9, level, -np.inf) > 0).any(axis=-1)
    return np.where((high >= low) & ~beside, middle + high, -np.inf)


@functools.lru_cache(maxsize=1024)
def reach_m(part: Part) -> float:
    """Greatest distance of a part from the item's own z axis."""
    return float(np.linalg.norm(np.abs(part.centre_m[:2]) + part.half_m[:2]))


@functools.lru_cache(maxsize=256)
def _planes(part: Part) -> Array:
    """Face planes (F, 4) of a hull about its centre: n · x + d <= 0 inside."""
    if part.vertices_m is None:
        raise ValueError("a hull needs vertices")
    return np.unique(
        np.round(scipy.spatial.ConvexHull(part.vertices_m - part.centre_m).equations, 12), axis=0
    )
