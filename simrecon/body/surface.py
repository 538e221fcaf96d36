"""Capsules and boxes as surfaces: signed distances of points, and points on them, with derivatives.

A primitive is its nine values (`sizes.VALUES`): capsule ends a (3), b (3), radius; box centre (3), 0 (3),
half sizes.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from simrecon.types import Array

_AROUND, _ALONG, _CAP_RINGS, _CELLS = 10, 4, 2, 4
_TINY = 1e-9


def distance(kind: str, values: Array, points_m: Array) -> tuple[Array, Array]:
    """Signed distance of points (P, 3) to a primitive, negative inside, and its derivative.

    Args:
        kind: `capsule` or `box`.
        values: (9,).
        points_m: (P, 3).

    Returns:
        (P,) m and (P, 9) derivatives by `values`.
    """
    return _to_capsule(values, points_m) if kind == "capsule" else _to_box(values, points_m)


def _to_capsule(values: Array, points_m: Array) -> tuple[Array, Array]:
    a, b = values[:3], values[3:6]
    axis = b - a
    share = np.clip((points_m - a) @ axis / max(float(axis @ axis), _TINY), 0.0, 1.0)[:, None]  # (P, 1)
    away = points_m - a - share * axis
    far = np.linalg.norm(away, axis=1, keepdims=True)
    unit = away / np.maximum(far, _TINY)
    one, zero = np.ones_like(share), np.zeros_like(share)
    return far[:, 0] - values[6], np.hstack((-(1 - share) * unit, -share * unit, -one, zero, zero))


def _to_box(values: Array, points_m: Array) -> tuple[Array, Array]:
    local = points_m - values[:3]
    side = np.where(local < 0, -1.0, 1.0)
    beyond = np.abs(local) - values[6:]  # (P, 3)
    out = np.maximum(beyond, 0.0)
    far = np.linalg.norm(out, axis=1)
    outward = out / np.maximum(far, _TINY)[:, None]
    inward = np.eye(3)[np.argmax(beyond, axis=1)]
    slope = np.where((far > 0)[:, None], outward, inward)  # (P, 3)
    apart = np.where(far > 0, far, beyond.max(axis=1))
    return apart, np.hstack((-slope * side, np.zeros_like(local), -slope))


def samples(kind: str, values: Array) -> tuple[Array, Array, Array]:
    """Points spread over the surface of a primitive.

    Args:
        kind: `capsule` or `box`.
        values: (9,).

    Returns:
        points (P, 3), area that each stands for (P,), and derivative (P, 3, 9) of the points by `values`; a
        turn of the capsule about its axis, which moves points along the surface only, is left out.
    """
    return _on_capsule(values) if kind == "capsule" else _on_box(values)


@cache
def _unit_capsule() -> tuple[Array, Array, Array, Array]:
    """Shares along the axis, normals in the capsule's frame (axis z), shares of cylinder's and caps' area."""
    turn = np.arange(_AROUND) * 2 * np.pi / _AROUND
    ring = np.column_stack((np.cos(turn), np.sin(turn), np.zeros(_AROUND)))
    share, normal, cylinder, cap = [], [], [], []
    for k in range(_ALONG):
        share.append(np.full(_AROUND, (k + 0.5) / _ALONG))
        normal.append(ring)
        cylinder.append(np.full(_AROUND, 1.0))
        cap.append(np.zeros(_AROUND))
    for end in (0.0, 1.0):
        for k in range(_CAP_RINGS):  # rings of equal area
            height = (k + 0.5) / _CAP_RINGS
            share.append(np.full(_AROUND, end))
            up = np.full((_AROUND, 1), height * (2 * end - 1))
            normal.append(np.hstack((ring[:, :2] * np.sqrt(1 - height**2), up)))
            cylinder.append(np.zeros(_AROUND))
            cap.append(np.full(_AROUND, 1.0))
    c, s = np.concatenate(cylinder), np.concatenate(cap)
    return np.concatenate(share), np.concatenate(normal), c / c.sum(), s / s.sum()


def _on_capsule(values: Array) -> tuple[Array, Array, Array]:
    share, normal, cylinder, cap = _unit_capsule()
    a, b, radius = values[:3], values[3:6], values[6]
    length = max(float(np.linalg.norm(b - a)), _TINY)
    u = (b - a) / length
    n = normal @ _frame(u).T  # (P, 3)
    area = 2 * np.pi * radius * length * cylinder + 4 * np.pi * radius**2 * cap
    # d n = (u × du) × n = du (u·n) - u (du·n), du = (1 - u uᵀ)(db - da) / length
    across = np.eye(3) - np.outer(u, u)
    turned = (
        radius / length * ((n @ u)[:, None, None] * across - u[:, None] * (n @ across)[:, None, :])
    )  # (P, 3, 3) by b
    slope = np.zeros((len(n), 3, 9))
    slope[:, :, :3] = (1 - share)[:, None, None] * np.eye(3) - turned
    slope[:, :, 3:6] = share[:, None, None] * np.eye(3) + turned
    slope[:, :, 6] = n
    return a + share[:, None] * (b - a) + radius * n, area, slope


def _frame(u: Array) -> Array:
    """Rotation (3, 3) with third column u: the smallest turn from the nearest axis, smooth in u."""
    k = int(np.argmax(np.abs(u)))
    near = np.eye(3)[k] * np.sign(u[k])
    across = np.cross(near, u)
    cross = np.cross(np.eye(3), across)  # (3, 3) cross @ x = across × x
    turn = np.eye(3) + cross + cross @ cross / (1.0 + float(near @ u))
    first = np.eye(3)[(k + 1) % 3]
    return np.asarray(turn @ np.column_stack((first, np.cross(near, first), near)))


@cache
def _unit_box() -> tuple[Array, Array]:
    """Points (P, 3) on a cube of half size 1 and the axis (P,) of their face."""
    grid = (np.arange(_CELLS) + 0.5) / _CELLS * 2 - 1
    u, v = (array.ravel() for array in np.meshgrid(grid, grid))
    points, axes = [], []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            face = np.empty((len(u), 3))
            face[:, axis], face[:, (axis + 1) % 3], face[:, (axis + 2) % 3] = sign, u, v
            points.append(face)
            axes.append(np.full(len(u), axis))
    return np.concatenate(points), np.concatenate(axes)


def _on_box(values: Array) -> tuple[Array, Array, Array]:
    unit, axis = _unit_box()
    half = values[6:]
    face = 4 * half.prod() / half / _CELLS**2  # (3,)
    slope = np.zeros((len(unit), 3, 9))
    slope[:, :, :3] = np.eye(3)
    slope[:, :, 6:] = unit[:, :, None] * np.eye(3)
    return values[:3] + unit * half, face[axis], slope
