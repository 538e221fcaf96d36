"""Euler angles R = R_a(α) R_b(β) R_c(γ) about three different axes, chosen so that β stays away from ±90°."""

from __future__ import annotations

from itertools import permutations

import numpy as np

from simrecon.geometry import rotations
from simrecon.types import Array

Axes = tuple[int, int, int]
"""Which of x, y, z the angles α, β, γ turn about."""


def angles(matrices: Array) -> tuple[Array, Axes]:
    """Continuous angles (T, 3) of rotations (T, 3, 3), and the axes for which β is safest.

    The axes of a flip, a cartwheel and a pirouette differ: no one order of axes serves all of them.
    """
    orders = [(a, b, c) for a, b, c in permutations(range(3))]
    axes = max(orders, key=lambda order: _margin(matrices, order))
    a, b, c = axes
    sign = _sign(axes)
    alpha = np.arctan2(-sign * matrices[:, b, c], matrices[:, c, c])
    beta = np.arcsin(np.clip(sign * matrices[:, a, c], -1.0, 1.0))
    gamma = np.arctan2(-sign * matrices[:, a, b], matrices[:, a, a])
    return np.unwrap(np.stack((alpha, beta, gamma), axis=1), axis=0), axes


def matrix(turns: Array, axes: Axes) -> Array:
    """Rotations (T, 3, 3) of angles (T, 3)."""
    steps = rotations.matrix(rotations.exp(turns[:, :, None] * np.eye(3)[list(axes)]))  # (T, 3, 3, 3)
    product: Array = steps[:, 0] @ steps[:, 1] @ steps[:, 2]
    return product


def _margin(matrices: Array, axes: Axes) -> float:
    """Least cos² β; axes of which the first is upright, as usual, are taken where they serve."""
    return float(np.min(1.0 - matrices[:, axes[0], axes[2]] ** 2)) + 0.3 * (axes[0] == 2)


def _sign(axes: Axes) -> float:
    """One for axes that follow each other as x, y, z do; else minus one."""
    return 1.0 if (axes[1] - axes[0]) % 3 == 1 else -1.0
