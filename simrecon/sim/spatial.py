"""Spatial vectors, batched: motions (ω, v) and forces (τ, f), (..., 6) each, about one point.

Source: R. Featherstone, "Rigid Body Dynamics Algorithms", Springer 2008, chapter 2.
"""

from __future__ import annotations

import numpy as np

from simrecon.geometry.rotations import skew
from simrecon.types import Array


def cross(a: Array, b: Array) -> Array:
    """A × b of vectors (..., 3); for few of them several times as fast as numpy's."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    product[..., 0] = ay * bz - az * by
    product[..., 1] = az * bx - ax * bz
    product[..., 2] = ax * by - ay * bx
    return product


def cross_motion(a: Array, b: Array) -> Array:
    """How a motion b that is carried along by a motion a changes, a × b (eq. 2.31)."""
    turn, shift = a[..., :3], a[..., 3:]
    turned = cross(turn, b[..., :3])
    return np.concatenate((turned, cross(turn, b[..., 3:]) + cross(shift, b[..., :3])), axis=-1)


def cross_force(a: Array, b: Array) -> Array:
    """How a force b that is carried along by a motion a changes, a ×* b (eq. 2.32)."""
    turn, shift = a[..., :3], a[..., 3:]
    torque = cross(turn, b[..., :3]) + cross(shift, b[..., 3:])
    return np.concatenate((torque, cross(turn, b[..., 3:])), axis=-1)


def matrix_motion(a: Array) -> Array:
    """The matrix (..., 6, 6) of b ↦ a × b."""
    turn, shift = skew(a[..., :3]), skew(a[..., 3:])
    return _blocks(turn, np.zeros_like(turn), shift, turn)


def matrix_force(a: Array) -> Array:
    """The matrix (..., 6, 6) of b ↦ a ×* b."""
    turn, shift = skew(a[..., :3]), skew(a[..., 3:])
    return _blocks(turn, shift, np.zeros_like(turn), turn)


def matrix_momentum(h: Array) -> Array:
    """The matrix (..., 6, 6) of a ↦ a ×* h, for a force or momentum h."""
    torque, force = skew(h[..., :3]), skew(h[..., 3:])
    return -_blocks(torque, force, force, np.zeros_like(force))


def inertia(packed: Array) -> Array:
    """The matrix (..., 6, 6) of MuJoCo's ten numbers `cinert` (..., 10) of a body (eq. 2.63)."""
    xx, yy, zz, xy, xz, yz = np.moveaxis(packed[..., :6], -1, 0)
    rows = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    about = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    moment = skew(packed[..., 6:9])
    return _blocks(about, moment, -moment, packed[..., 9, None, None] * np.eye(3))


def _blocks(a: Array, b: Array, c: Array, d: Array) -> Array:
    """The matrix (..., 6, 6) of four (..., 3, 3)."""
    return np.concatenate((np.concatenate((a, b), axis=-1), np.concatenate((c, d), axis=-1)), axis=-2)
