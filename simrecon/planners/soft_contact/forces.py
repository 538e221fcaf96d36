"""The forces by which a scene best explains a wrench: a convex problem of each frame, solved in its dual.

    min_f  ½ ‖w - A f‖² + Σ_i (½ k_i ‖f_i‖² - b_i · f_i),   f_i in the friction cone of contact i

with A what unit forces add to the wrench, and b what is wanted of the forces. With the residual r = w - A f,
f_i = P_i((A_iᵀ r + b_i) / k_i), P_i the projection onto the cone. So r, of six numbers, is the minimum of the
smooth and strongly convex

    φ(r) = ½ ‖r‖² - r · w + Σ_i k_i / 2 ‖P_i((A_iᵀ r + b_i) / k_i)‖²

which Newton's method finds in a few steps, for all frames at once.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from simrecon.types import Array, IntArray

STEPS, HALVINGS, TOLERANCE = 40, 12, 1e-7
DECREASE = 1e-4
"""Share of the decrease that the slope promises, which a step must have (Armijo)."""


@dataclass(frozen=True, eq=False)
class Explained:
    """What forces explain of a wrench, and what is left.

    Attributes:
        forces: (T, C, 3). residual: (T, 6) w - A f.
        stiffness: (T, 6, 6) second derivative of φ; its inverse is that of the least loss by w.
    """

    forces: Array
    residual: Array
    stiffness: Array


def explain(
    wrench: Array,
    arms: Array,
    cost: Array,
    normals: Array,
    friction: Array,
    start: Array | None = None,
    wanted: Array | None = None,
) -> Explained:
    """Solve all frames.

    Args:
        wrench: (T, 6) w.
        arms: (T, C, 6, 3) A.
        cost: (T, C) k, positive.
        normals: (T, C, 3) unit vectors along which the scene pushes.
        friction: (T, C) coefficients.
        start: (T, 6) residuals to begin with; None: those without forces.
        wanted: (T, C, 3) b; None: zero.
    """
    cones = _Cones.of(arms, cost, normals, friction, np.zeros_like(normals) if wanted is None else wanted)
    r = wrench.copy() if start is None else start.copy()
    value, slope, hessian, forces = _dual(r, wrench, cones)
    limit = TOLERANCE * (1.0 + np.linalg.norm(wrench, axis=1))
    for _ in range(STEPS):
        going = np.flatnonzero(np.linalg.norm(slope, axis=1) > limit)
        if not len(going):
            break
        own = cones if len(going) == len(r) else cones.at(going)
        step = -np.linalg.solve(hessian[going], slope[going][..., None])[..., 0]
        expected = np.sum(step * slope[going], axis=1)
        length = np.ones(len(going))
        for _ in range(HALVINGS):
            tried = r[going] + length[:, None] * step
            found = _dual(tried, wrench[going], own)
            bad = found[0] > value[going] + DECREASE * length * expected + 1e-12 * np.abs(value[going])
            if not bad.any():
                break
            length = np.where(bad, length / 2, length)
        r[going] = tried
        for all_frames, some in zip((value, slope, hessian, forces), found, strict=True):
            all_frames[going] = some
    return Explained(forces, r, hessian)


@dataclass(frozen=True, eq=False)
class _Cones:
    """Contacts of all frames, laid out for products.

    Attributes:
        columns: (T, C, 3, 6) columns of A. along: (T, C, 6) A n.
        cost: (T, C). normals: (T, C, 3). friction: (T, C). wanted: (T, C, 3).
    """

    columns: Array
    along: Array
    cost: Array
    normals: Array
    friction: Array
    wanted: Array

    @classmethod
    def of(cls, arms: Array, cost: Array, normals: Array, friction: Array, wanted: Array) -> _Cones:
        """Those of `explain`'s arguments."""
        columns = np.ascontiguousarray(np.swapaxes(arms, -1, -2))
        return cls(columns, _moved(columns, normals), cost, normals, friction, wanted)

    def at(self, rows: IntArray) -> _Cones:
        """Those of some frames."""
        return _Cones(*(getattr(self, field.name)[rows] for field in fields(self)))


def _moved(columns: Array, vectors: Array) -> Array:
    """A v of columns (T, C, 3, 6) and vectors (T, C, 3), (T, C, 6)."""
    moved = columns[..., 0, :] * vectors[..., :1]
    moved += columns[..., 1, :] * vectors[..., 1:2]
    moved += columns[..., 2, :] * vectors[..., 2:]
    return np.asarray(moved)


def _dual(r: Array, wrench: Array, cones: _Cones) -> tuple[Array, Array, Array, Array]:
    """φ (T,), its slope (T, 6) and second derivative (T, 6, 6), and the forces (T, C, 3) at r (T, 6)."""
    frames = len(r)
    flat = cones.columns.reshape(frames, -1, 6)  # (T, 3 C, 6)
    pushed = (flat @ r[..., None]).reshape(cones.normals.shape) + cones.wanted
    pushed /= cones.cost[..., None]  # (T, C, 3)
    near = _Nearest(pushed, cones.normals, cones.friction)
    forces = near.vectors
    value = 0.5 * np.sum(r**2, axis=1) - np.sum(r * wrench, axis=1)
    value = value + 0.5 * np.sum(cones.cost * np.sum(forces**2, axis=2), axis=1)
    slope = r - wrench + (forces.reshape(frames, 1, -1) @ flat)[:, 0]
    same, ray, bend = (weight / cones.cost for weight in (near.same, near.ray, near.bend))
    friction, n = cones.friction, cones.along
    d = _moved(cones.columns, near.direction)  # (T, C, 6)
    by_n = (ray - bend)[..., None] * n + (ray * friction)[..., None] * d
    by_d = (ray * friction)[..., None] * n + (ray * friction**2 - bend)[..., None] * d
    hessian = np.eye(6) + np.swapaxes(flat, 1, 2) @ (np.repeat(same, 3, axis=1)[..., None] * flat)
    hessian = hessian + np.swapaxes(n, 1, 2) @ by_n + np.swapaxes(d, 1, 2) @ by_d
    return value, slope, hessian, forces


class _Nearest:
    """The nearest vectors in friction cones.

    With t = n + μ d their derivative is

        same I + ray t tᵀ - bend (n nᵀ + d dᵀ)

    Attributes:
        vectors: (..., 3).
        direction: (..., 3) d, in which a vector leaves the axis n.
        same, ray, bend: (...).
    """

    def __init__(self, vectors: Array, normals: Array, friction: Array) -> None:
        """Of vectors (..., 3) and cones around axes (..., 3) with coefficients (...)."""
        along = _dot(vectors, normals)
        across = vectors - along[..., None] * normals
        slip = np.sqrt(_dot(across, across))
        inside = slip <= friction * along
        edge = ~inside & (friction * slip > -along)
        least = np.maximum(slip, 1e-300)
        self.direction = across / least[..., None]
        self.ray = np.where(edge, 1 / (1 + friction**2), 0.0)
        share = (friction * slip + along) * self.ray
        self.bend = share * friction / least
        self.same = np.where(inside, 1.0, self.bend)
        ends = share[..., None] * (normals + friction[..., None] * self.direction)
        self.vectors = np.where(inside[..., None], vectors, ends)


def _dot(a: Array, b: Array) -> Array:
    """Products of vectors (..., 3), (...)."""
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2])


def project(vectors: Array, normals: Array, friction: Array) -> tuple[Array, Array]:
    """The nearest vectors in friction cones, and the derivative of that.

    Args:
        vectors: (..., 3).
        normals: (..., 3) axes of the cones.
        friction: (...) coefficients.

    Returns:
        (..., 3) and (..., 3, 3).
    """
    near = _Nearest(vectors, normals, friction)
    same, ray, bend = (weight[..., None, None] for weight in (near.same, near.ray, near.bend))
    n, d = normals[..., None], near.direction[..., None]
    t = n + friction[..., None, None] * d
    outer = n @ np.swapaxes(n, -1, -2) + d @ np.swapaxes(d, -1, -2)
    return near.vectors, same * np.eye(3) + ray * (t @ np.swapaxes(t, -1, -2)) - bend * outer
