"""Rotations as unit quaternions (wxyz), rotation vectors and matrices, batched over leading axes.

Formulas: Solà, "Quaternion kinematics for the error-state Kalman filter" (2017);
equation numbers are his.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from simrecon.types import Array

_SMALL = 1e-8  # rad; below it the series' first terms are exact to rounding


def multiply(a: ArrayLike, b: ArrayLike) -> Array:
    """Hamilton product a ⊗ b (eq. 12). Shapes (..., 4), broadcast; returns (..., 4)."""
    aw, ax, ay, az = np.moveaxis(np.asarray(a, float), -1, 0)
    bw, bx, by, bz = np.moveaxis(np.asarray(b, float), -1, 0)
    return np.stack(
        (
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ),
        axis=-1,
    )


def conjugate(q: ArrayLike) -> Array:
    """The inverse of unit quaternions. Shape (..., 4)."""
    inverse: Array = np.asarray(q, float) * np.array([1.0, -1.0, -1.0, -1.0])
    return inverse


def canonical(q: ArrayLike) -> Array:
    """Unit length and w >= 0. Shape (..., 4)."""
    raw = np.asarray(q, float)
    unit = raw / np.linalg.norm(raw, axis=-1, keepdims=True)
    positive: Array = np.where(unit[..., :1] < 0, -unit, unit)
    return positive


def rotate(q: ArrayLike, v: ArrayLike) -> Array:
    """Rotate vectors v (..., 3) by unit quaternions q (..., 4)."""
    q, v = np.asarray(q, float), np.asarray(v, float)
    t = 2.0 * np.cross(q[..., 1:], v)
    rotated: Array = v + q[..., :1] * t + np.cross(q[..., 1:], t)
    return rotated


def exp(rotvec: ArrayLike) -> Array:
    """Rotation vector (..., 3), rad → unit quaternion (..., 4) (eq. 101)."""
    rotvec = np.asarray(rotvec, float)
    angle = np.linalg.norm(rotvec, axis=-1, keepdims=True)
    scale = 0.5 * np.sinc(angle / (2 * np.pi))
    return np.concatenate((np.cos(0.5 * angle), scale * rotvec), axis=-1)


def log(q: ArrayLike) -> Array:
    """Unit quaternion (..., 4) → rotation vector (..., 3) with angle in [0, π] (eq. 105)."""
    q = np.asarray(q, float)
    real, vector = q[..., 0], q[..., 1:]
    sine = np.sqrt(np.einsum("...i,...i->...", vector, vector))
    angle = 2.0 * np.arctan2(sine, np.abs(real))
    scale = np.divide(angle, sine, out=np.full(sine.shape, 2.0), where=sine > _SMALL)
    rotvec: Array = np.where(real < 0, -scale, scale)[..., None] * vector
    return rotvec


def angle_between(a: ArrayLike, b: ArrayLike) -> Array:
    """Geodesic angle between orientations, rad in [0, π]. Shapes (..., 4), broadcast; returns (...)."""
    dot = np.abs(np.sum(np.asarray(a, float) * np.asarray(b, float), axis=-1))
    angle: Array = 2.0 * np.arccos(np.minimum(dot, 1.0))
    return angle


def matrix(q: ArrayLike) -> Array:
    """Unit quaternion (..., 4) → rotation matrix (..., 3, 3) (eq. 115)."""
    w, x, y, z = np.moveaxis(np.asarray(q, float), -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return _of_entries(rows)


def _of_entries(rows: Sequence[Sequence[Array]]) -> Array:
    """Matrices (..., 3, 3) of their entries (...); several times as fast as stacking them."""
    matrices = np.empty((*rows[0][0].shape, 3, 3))
    for i, row in enumerate(rows):
        for j, entry in enumerate(row):
            matrices[..., i, j] = entry
    return matrices


def from_matrix(m: ArrayLike) -> Array:
    """Rotation matrix (..., 3, 3) → unit quaternion (..., 4), w >= 0, by largest part (Shepperd 1978)."""
    m = np.asarray(m, float)
    d = np.stack((m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]), axis=-1)  # (..., 3)
    trace = d.sum(-1)
    candidates = np.stack(
        (
            np.stack(
                (
                    1 + trace,
                    m[..., 2, 1] - m[..., 1, 2],
                    m[..., 0, 2] - m[..., 2, 0],
                    m[..., 1, 0] - m[..., 0, 1],
                ),
                -1,
            ),
            np.stack(
                (
                    m[..., 2, 1] - m[..., 1, 2],
                    1 + 2 * d[..., 0] - trace,
                    m[..., 1, 0] + m[..., 0, 1],
                    m[..., 0, 2] + m[..., 2, 0],
                ),
                -1,
            ),
            np.stack(
                (
                    m[..., 0, 2] - m[..., 2, 0],
                    m[..., 1, 0] + m[..., 0, 1],
                    1 + 2 * d[..., 1] - trace,
                    m[..., 2, 1] + m[..., 1, 2],
                ),
                -1,
            ),
            np.stack(
                (
                    m[..., 1, 0] - m[..., 0, 1],
                    m[..., 0, 2] + m[..., 2, 0],
                    m[..., 2, 1] + m[..., 1, 2],
                    1 + 2 * d[..., 2] - trace,
                ),
                -1,
            ),
        ),
        axis=-2,
    )  # (..., 4 candidates, 4)
    largest = np.argmax(np.concatenate((trace[..., None], d), axis=-1), axis=-1)  # (...,)
    return canonical(np.take_along_axis(candidates, largest[..., None, None], axis=-2)[..., 0, :])


def skew(v: ArrayLike) -> Array:
    """Cross-product matrix of vectors (..., 3) → (..., 3, 3)."""
    x, y, z = np.moveaxis(np.asarray(v, float), -1, 0)
    o = np.zeros_like(x)
    return _of_entries(((o, -z, y), (z, o, -x), (-y, x, o)))


def _combined(c: Array, a: Array, b: Array, v: Array) -> Array:
    """Sum c 1 + a [v]ₓ + b v vᵀ of factors (...) and vectors v (..., 3), (..., 3, 3)."""
    x, y, z = np.moveaxis(v, -1, 0)
    xy, yz, zx, ax, ay, az = b * (x * y), b * (y * z), b * (z * x), a * x, a * y, a * z
    return _of_entries(
        (
            (c + b * (x * x), xy - az, zx + ay),
            (xy + az, c + b * (y * y), yz - ax),
            (zx - ay, yz + ax, c + b * (z * z)),
        )
    )


def left_jacobian(rotvec: ArrayLike) -> Array:
    """J_l with exp(v + δ) ≈ exp(J_l δ) ⊗ exp(v) (eq. 145). (..., 3) → (..., 3, 3)."""
    rotvec = np.asarray(rotvec, float)
    angle = np.linalg.norm(rotvec, axis=-1)
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    a = np.where(small, 0.5 - angle**2 / 24, (1 - np.cos(safe)) / safe**2)
    b = np.where(small, 1 / 6 - angle**2 / 120, (safe - np.sin(safe)) / (safe * safe**2))
    return _combined(1 - b * angle**2, a, b, rotvec)  # [v]ₓ² = v vᵀ - |v|² 1


def log_jacobian(rotvec: ArrayLike) -> Array:
    """J_r⁻¹ with log(exp(v) ⊗ exp(δ)) ≈ v + J_r⁻¹ δ (eq. 144), singular at a full turn.

    (..., 3) → (..., 3, 3).
    """
    rotvec = np.asarray(rotvec, float)
    angle = np.linalg.norm(rotvec, axis=-1)
    small = angle < 1e-3
    safe = np.where(small, 1.0, angle)
    b = np.where(small, 1 / 12 + angle**2 / 720, 1 / safe**2 - 0.5 / (safe * np.tan(0.5 * safe)))
    return _combined(1 - b * angle**2, np.full_like(angle, 0.5), b, rotvec)


def slerp(a: ArrayLike, b: ArrayLike, fraction: ArrayLike) -> Array:
    """Shortest-path interpolation from a to b; shapes (..., 4), fraction (...)."""
    step = log(multiply(conjugate(a), b))
    return multiply(a, exp(np.asarray(fraction, float)[..., None] * step))


def interpolate(times_s: Array, q: Array, at_s: Array) -> Array:
    """Piecewise slerp of q (T, ..., 4) from increasing times (T,) to `at_s` (N,), held at both ends."""
    at_s = np.clip(at_s, times_s[0], times_s[-1])
    i = np.clip(np.searchsorted(times_s, at_s, side="right") - 1, 0, len(times_s) - 2)
    fraction = (at_s - times_s[i]) / (times_s[i + 1] - times_s[i])  # (N,)
    shape = (len(at_s),) + (1,) * (q.ndim - 2)
    return slerp(q[i], q[i + 1], np.broadcast_to(fraction.reshape(shape), q[i].shape[:-1]))


def align(source: ArrayLike, target: ArrayLike, weights: ArrayLike | None = None) -> Array:
    """Best rotation R, (..., 3, 3), with target ≈ R source for centred points (..., N, 3) (Kabsch 1976)."""
    source, target = np.asarray(source, float), np.asarray(target, float)
    w = np.ones(source.shape[-2]) if weights is None else np.asarray(weights, float)
    h = np.swapaxes(target * w[..., None], -1, -2) @ source  # (..., 3, 3)
    u, _, vt = np.linalg.svd(h)
    sign = np.linalg.det(u @ vt)
    u = u * np.stack((np.ones_like(sign), np.ones_like(sign), sign), axis=-1)[..., None, :]
    rotation: Array = u @ vt
    return rotation
