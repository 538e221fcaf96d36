"""The forces by which a scene best explains a wrench: a convex problem of each frame, solved in its dual.

    min_f  ½ ‖w - A f‖² + Σ_i ½ k_i ‖f_i‖²,   f_i in the friction cone of contact i

with A what unit forces add to the wrench. With the residual r = w - A f, f_i = P_i(A_iᵀ r / k_i), P_i the
projection onto the cone. So r, of six numbers, is the minimum of the smooth and strongly convex

    φ(r) = ½ ‖r‖² - r · w + Σ_i k_i / 2 ‖P_i(A_iᵀ r / k_i)‖²

which Newton's method finds in a few steps, for all frames at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon.types import Array

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
    wrench: Array, arms: Array, cost: Array, normals: Array, friction: Array, start: Array | None = None
) -> Explained:
    """Solve all frames.

    Args:
        wrench: (T, 6) w.
        arms: (T, C, 6, 3) A.
        cost: (T, C) k, positive.
        normals: (T, C, 3) unit vectors along which the scene pushes.
        friction: (T, C) coefficients.
        start: (T, 6) residuals to begin with; None: those without forces.
    """
    r = wrench.copy() if start is None else start.copy()
    value, slope, hessian, forces = _dual(r, wrench, arms, cost, normals, friction)
    limit = TOLERANCE * (1.0 + np.linalg.norm(wrench, axis=1))
    for _ in range(STEPS):
        going = np.flatnonzero(np.linalg.norm(slope, axis=1) > limit)
        if not len(going):
            break
        own = tuple(values[going] for values in (wrench, arms, cost, normals, friction))
        step = -np.linalg.solve(hessian[going], slope[going][..., None])[..., 0]
        expected = np.sum(step * slope[going], axis=1)
        length = np.ones(len(going))
        for _ in range(HALVINGS):
            tried = r[going] + length[:, None] * step
            found = _dual(tried, *own)
            bad = found[0] > value[going] + DECREASE * length * expected + 1e-12 * np.abs(value[going])
            if not bad.any():
                break
            length = np.where(bad, length / 2, length)
        r[going] = tried
        for all_frames, some in zip((value, slope, hessian, forces), found, strict=True):
            all_frames[going] = some
    return Explained(forces, r, hessian)


def _dual(
    r: Array, wrench: Array, arms: Array, cost: Array, normals: Array, friction: Array
) -> tuple[Array, Array, Array, Array]:
    """φ (T,), its slope (T, 6) and second derivative (T, 6, 6), and the forces (T, C, 3) at r (T, 6)."""
    pushed = (np.swapaxes(arms, -1, -2) @ r[:, None, :, None])[..., 0] / cost[..., None]  # (T, C, 3)
    forces, turned = project(pushed, normals, friction)
    value = 0.5 * np.sum(r**2, axis=1) - np.sum(r * wrench, axis=1)
    value = value + 0.5 * np.sum(cost * np.sum(forces**2, axis=2), axis=1)
    flat = np.swapaxes(arms, 1, 2).reshape(len(r), 6, -1)  # (T, 6, 3 C)
    slope = r - wrench + (flat @ forces.reshape(len(r), -1, 1))[..., 0]
    softened = np.swapaxes((arms @ turned) / cost[..., None, None], 1, 2).reshape(len(r), 6, -1)
    hessian = np.eye(6) + softened @ np.swapaxes(flat, 1, 2)
    return value, slope, hessian, forces


def project(vectors: Array, normals: Array, friction: Array) -> tuple[Array, Array]:
    """The nearest vectors in friction cones, and the derivative of that.

    Args:
        vectors: (..., 3).
        normals: (..., 3) axes of the cones.
        friction: (...) coefficients.

    Returns:
        (..., 3) and (..., 3, 3).
    """
    along = np.sum(vectors * normals, axis=-1)
    across = vectors - along[..., None] * normals
    slip = np.linalg.norm(across, axis=-1)
    inside = slip <= friction * along
    outside = friction * slip <= -along
    edge = ~inside & ~outside
    direction = across / np.maximum(slip, 1e-300)[..., None]
    ray = normals + friction[..., None] * direction
    share = (friction * slip + along) / (1 + friction**2)
    projected = np.where(inside[..., None], vectors, np.where(edge[..., None], share[..., None] * ray, 0.0))
    outer = ray[..., :, None] * ray[..., None, :] / (1 + friction**2)[..., None, None]
    unit = np.eye(3) - normals[..., :, None] * normals[..., None, :]
    round_ = unit - direction[..., :, None] * direction[..., None, :]
    bend = np.where(edge, share * friction / np.maximum(slip, 1e-300), 0.0)
    turned = np.where(edge[..., None, None], outer + bend[..., None, None] * round_, 0.0)
    turned = np.where(inside[..., None, None], np.eye(3), turned)
    return projected, turned
