"""Heights and distances in a scene at rest, for the kinematic fit and for scores."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from simrecon.scene import sheets, solids, surfaces
from simrecon.scene.parts import Part
from simrecon.types import Array, Ground, Scene, SceneItem

# Items farther than this from all of the body, seen from above, don't matter to it.
_REACH_M = 0.5
SHEET = "sheet"
"""Name of the part that stands for a sprung sheet."""


def ground_height(ground: Ground, xy_m: Array) -> Array:
    """Height of the floor (...), in metres, under points (..., 2)."""
    height = np.full(xy_m.shape[:-1], float(ground.height_m))
    if ground.slope_rad:
        uphill = [math.cos(ground.slope_yaw_rad), math.sin(ground.slope_yaw_rad)]
        height = height + math.tan(ground.slope_rad) * (xy_m @ np.array(uphill))
    return height


def support_height(scene: Scene, xy_m: Array) -> Array:
    """Height of the highest support under points: the top of an item at rest, or the ground.

    Args:
        scene: floor and items.
        xy_m: (..., 2) horizontal positions.

    Returns:
        (...) heights in metres.
    """
    height = ground_height(scene.ground, xy_m)
    for item in scene.items:
        cos, sin = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
        local = (xy_m - np.array(item.position_m[:2])) @ np.array([[cos, -sin], [sin, cos]])  # (..., 2)
        for part in _parts(item, scene.folder):
            top = surfaces.top(part, local - part.centre_m[:2])  # (...) over the item's origin
            height = np.maximum(height, item.position_m[2] + top)
    return height


def nearby(scene: Scene, points_m: Array) -> tuple[Array, Array]:
    """`distances` for a body that presses beds down.

    They are infinite to items that are half a metre or more from it, seen from above.

    Args:
        scene: floor and items.
        points_m: (G, T, 3) points of the body.

    Returns:
        (1 + S, G, T) distances and (1 + S, G, T, 3) gradients of the ground and the S items that are
        near in some frame.
    """
    ground = replace(scene, items=())
    apart, normals = distances(ground, points_m)
    if not scene.items:
        return apart, normals
    low, high = points_m.min(axis=0)[:, None, :2], points_m.max(axis=0)[:, None, :2]  # (T, 1, 2)
    circles = np.array([_circle(item, scene.folder) for item in scene.items])  # (items, 3)
    beyond = np.maximum(np.maximum(low - circles[:, :2], circles[:, :2] - high), 0.0)  # (T, items, 2)
    close = np.linalg.norm(beyond, axis=-1) - circles[:, 2] < _REACH_M  # (T, items)
    near, slopes = [apart[0]], [normals[0]]
    for item, frames in zip(scene.items, close.T, strict=True):
        if frames.any():
            far, flat = np.full(points_m.shape[:2], np.inf), np.zeros(points_m.shape)
            alone = replace(scene, items=(item,))
            here = points_m if frames.all() else points_m[:, frames]
            distance, slope = distances(alone, here, pressed=True)
            far[:, frames], flat[:, frames] = distance[1], slope[1]
            near.append(far)
            slopes.append(flat)
    return np.stack(near), np.stack(slopes)


def _circle(item: SceneItem, folder: str) -> tuple[float, float, float]:
    """Centre and radius of a circle around an item, seen from above."""
    reach = max(surfaces.reach_m(part) for part in _parts(item, folder))
    return item.position_m[0], item.position_m[1], reach


def distances(scene: Scene, points_m: Array, *, pressed: bool = False) -> tuple[Array, Array]:
    """Signed distance of points to the ground and to each item at rest, negative inside, and its gradient.

    Deep parts go down without end: nothing gets under them. Outside a hull, the distance is that to its
    farthest face plane, and over a height field that to its slope; near edges both are too small.

    Args:
        scene: floor and items.
        points_m: (..., 3) in the world.
        pressed: whether a trampoline gives way: nothing is inside it until its bed is as low as it goes.

    Returns:
        (1 + items, ...) distances in metres and (1 + items, ..., 3) unit gradients.
    """
    ground = scene.ground
    up = np.array([0.0, 0.0, 1.0])
    apart = [points_m[..., 2] - ground.height_m]
    if ground.slope_rad:
        slope, yaw = math.sin(ground.slope_rad), ground.slope_yaw_rad
        up = np.array([-slope * math.cos(yaw), -slope * math.sin(yaw), math.cos(ground.slope_rad)])
        apart = [(points_m - [0.0, 0.0, ground.height_m]) @ up]
    normals = [np.broadcast_to(up, points_m.shape)]
    for item in scene.items:
        cos, sin = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
        turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])  # item → world
        nearest, normal = _to_item(item, scene.folder, turn, points_m, pressed=pressed)
        apart.append(nearest)
        normals.append(normal @ turn.T)
    return np.stack(apart), np.stack(normals)


def _to_item(
    item: SceneItem, folder: str, turn: Array, points_m: Array, *, pressed: bool
) -> tuple[Array, Array]:
    """Distance (...) to the nearest part, and its gradient (..., 3) in the item's frame."""
    best, normal = np.full(points_m.shape[:-1], np.inf), np.zeros(points_m.shape)
    for part in _parts(item, folder):
        x, y, z = item.position_m
        dx, dy, dz = part.centre_m
        centre = np.array(
            [x + turn[0, 0] * dx + turn[0, 1] * dy, y + turn[1, 0] * dx + turn[1, 1] * dy, z + dz]
        )
        if part.deep:
            centre[2] = z + (dz + part.half_m[2])
        local = (points_m - centre) @ turn  # (..., 3) from the middle of its top, or of the part
        apart, gradient = surfaces.distance(part, local)
        if pressed and item.kind == "trampoline" and part.name == SHEET:
            apart = np.where(apart < 0, np.minimum(apart + sheets.depth_m(item), 0.0), apart)
        if not np.isfinite(best).any():  # the first part
            best, normal = apart, gradient
            continue
        nearer = apart < best
        best = np.where(nearer, apart, best)
        normal = np.where(nearer[..., None], gradient, normal)
    return best, normal


def _parts(item: SceneItem, folder: str) -> tuple[Part, ...]:
    """Parts of an item, with its sprung sheet as the block under its rest height; recent ones are kept."""
    key = (item.kind, tuple(sorted(item.parameters.items())), folder)
    if key not in _recent:
        if len(_recent) > 500:
            _recent.clear()
        parts = solids.parts_of(item, folder)
        sheet = sheets.sheet_of(item)
        if sheet is not None:
            half = np.array([sheet.size_m[0] / 2, sheet.size_m[1] / 2, sheet.centre_m[2] / 2])
            block = Part(SHEET, "box", sheet.centre_m - [0.0, 0.0, half[2]], half, True)
            parts = (*parts, block)
        _recent[key] = parts
    return _recent[key]


_recent: dict[object, tuple[Part, ...]] = {}
