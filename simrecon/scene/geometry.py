"""Heights and distances in a scene at rest, for the kinematic fit and for scores."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np
from scipy.spatial import ConvexHull

from simrecon.scene import parts
from simrecon.scene.parts import Part
from simrecon.types import Array, Ground, Scene, SceneItem

# Beyond this distance from the bounds of a hull, the distance to its bounding sphere is good enough.
_NEAR_M = 0.3
# Things farther than this from all of the body, seen from above, don't matter to it.
_REACH_M = 0.5


def ground_height(ground: Ground, xy_m: Array) -> Array:
    """Height of the floor under points xy_m (..., 2), (...)."""
    height = np.full(xy_m.shape[:-1], float(ground.height_m))
    if ground.slope_rad:
        uphill = [math.cos(ground.slope_yaw_rad), math.sin(ground.slope_yaw_rad)]
        height = height + math.tan(ground.slope_rad) * (xy_m @ np.array(uphill))
    return height


def support_height(scene: Scene, xy_m: Array) -> Array:
    """Height of the highest support under points: the top of a thing at rest, or the ground.

    Args:
        scene: floor and things.
        xy_m: (..., 2) horizontal positions.

    Returns:
        (...) heights in metres.
    """
    height = ground_height(scene.ground, xy_m)
    for item in scene.items:
        cos, sin = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
        local = (xy_m - np.array(item.position_m[:2])) @ np.array([[cos, -sin], [sin, cos]])  # (..., 2)
        for part in _solid(item, scene.folder):
            top = _top(part, local - part.centre_m[:2])  # (...) over the item's origin, -inf beside it
            height = np.maximum(height, item.position_m[2] + top)
    return height


def nearby(scene: Scene, points_m: Array) -> tuple[Array, Array]:
    """`distances` for a body, infinite where it is not within half a metre of a thing, seen from above.

    Args:
        scene: floor and things.
        points_m: (G, T, 3) points of the body.

    Returns:
        (1 + S, G, T) distances and (1 + S, G, T, 3) gradients for the S things that are near in some frame.
    """
    ground = replace(scene, items=())
    apart, normals = distances(ground, points_m)
    if not scene.items:
        return apart, normals
    low, high = points_m.min(axis=0)[:, None, :2], points_m.max(axis=0)[:, None, :2]  # (T, 1, 2)
    circles = np.array([_circle(item, scene.folder) for item in scene.items])  # (items, 3)
    beyond = np.maximum(np.maximum(low - circles[:, :2], circles[:, :2] - high), 0.0)  # (T, items, 2)
    close = np.linalg.norm(beyond, axis=-1) - circles[:, 2] < _REACH_M  # (T, items)
    found, slopes = [apart[0]], [normals[0]]
    for item, frames in zip(scene.items, close.T, strict=True):
        if frames.any():
            far, flat = np.full(points_m.shape[:2], np.inf), np.zeros(points_m.shape)
            alone = replace(scene, items=(item,))
            here = points_m if frames.all() else points_m[:, frames]
            distance, slope = distances(alone, here)
            far[:, frames], flat[:, frames] = distance[1], slope[1]
            found.append(far)
            slopes.append(flat)
    return np.stack(found), np.stack(slopes)


def _circle(item: SceneItem, folder: str) -> tuple[float, float, float]:
    """Centre and radius of a circle around a thing, seen from above."""
    reach = max(_reach(part) for part in _solid(item, folder))
    return item.position_m[0], item.position_m[1], reach


def distances(scene: Scene, points_m: Array) -> tuple[Array, Array]:
    """Signed distance of points to the ground and to each thing at rest, negative inside, and its gradient.

    Solid things count as reaching down without end: nothing gets under them. Outside of a hull, the distance
    is that to its farthest face plane, and of a height field that to its slope, which are less near edges.

    Args:
        scene: floor and things.
        points_m: (..., 3).

    Returns:
        (1 + items, ...) distances in metres and (1 + items, ..., 3) unit gradients.
    """
    ground = scene.ground
    up = np.array([0.0, 0.0, 1.0])
    found = [points_m[..., 2] - ground.height_m]
    if ground.slope_rad:
        slope, yaw = math.sin(ground.slope_rad), ground.slope_yaw_rad
        up = np.array([-slope * math.cos(yaw), -slope * math.sin(yaw), math.cos(ground.slope_rad)])
        found = [(points_m - [0.0, 0.0, ground.height_m]) @ up]
    normals = [np.broadcast_to(up, points_m.shape)]
    for item in scene.items:
        cos, sin = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
        turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])  # item → world
        nearest, normal = _to_item(item, scene.folder, turn, points_m)
        found.append(nearest)
        normals.append(normal @ turn.T)
    return np.stack(found), np.stack(normals)


def _to_item(item: SceneItem, folder: str, turn: Array, points_m: Array) -> tuple[Array, Array]:
    """Distance (...) to the nearest part, and its gradient (..., 3) in the item's frame."""
    best, normal = np.full(points_m.shape[:-1], np.inf), np.zeros(points_m.shape)
    for part in _solid(item, folder):
        x, y, z = item.position_m
        dx, dy, dz = part.centre_m
        centre = np.array(
            [x + turn[0, 0] * dx + turn[0, 1] * dy, y + turn[1, 0] * dx + turn[1, 1] * dy, z + dz]
        )
        if part.deep:
            centre[2] = z + (dz + part.half_m[2])
        local = (points_m - centre) @ turn  # (..., 3) from the middle of its top, or of the part
        apart, gradient = _to_part(part, local)
        if not np.isfinite(best).any():  # the first part
            best, normal = apart, gradient
            continue
        nearer = apart < best
        best = np.where(nearer, apart, best)
        normal = np.where(nearer[..., None], gradient, normal)
    return best, normal


def _to_part(part: Part, local_m: Array) -> tuple[Array, Array]:
    """Distance and gradient of points from the part's centre, or from the middle of a deep part's top."""
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
    """Points are given from the middle of the field's highest level."""
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


def _top(part: Part, local_xy: Array) -> Array:
    """Height of the upper side over the item's origin under points from the part's centre; -inf beside it."""
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
def _reach(part: Part) -> float:
    """Greatest distance of a part from the item's own z axis."""
    return float(np.linalg.norm(np.abs(part.centre_m[:2]) + part.half_m[:2]))


@functools.lru_cache(maxsize=256)
def _planes(part: Part) -> Array:
    """Face planes (F, 4) of a hull about its centre: n · x + d <= 0 inside."""
    if part.vertices_m is None:
        raise ValueError("a hull needs vertices")
    return np.unique(np.round(ConvexHull(part.vertices_m - part.centre_m).equations, 12), axis=0)


def _solid(item: SceneItem, folder: str) -> tuple[Part, ...]:
    """Parts of a thing, a sprung sheet as the block under its rest height; kept for the last things seen."""
    key = (item.kind, tuple(sorted(item.parameters.items())), folder)
    if key not in _seen:
        if len(_seen) > 500:
            _seen.clear()
        found = parts.solid(item, folder)
        sheet = parts.sheet(item)
        if sheet is not None:
            half = np.array([sheet.size_m[0] / 2, sheet.size_m[1] / 2, sheet.centre_m[2] / 2])
            block = Part("sheet", "box", sheet.centre_m - [0.0, 0.0, half[2]], half, True)
            found = (*found, block)
        _seen[key] = found
    return _seen[key]


_seen: dict[object, tuple[Part, ...]] = {}
