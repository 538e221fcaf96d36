"""Analytic gradients against central differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from simrecon.types import Array

Function = Callable[[Array], tuple[float, Array]]
"""Loss and gradient (n,) at x (n,)."""


def differences(function: Function, x: Array, step: float = 1e-6) -> Array:
    """Central differences of a loss by x of any shape."""
    slopes = np.empty_like(x)
    for index in np.ndindex(x.shape):
        ahead, behind = x.copy(), x.copy()
        ahead[index] += step
        behind[index] -= step
        slopes[index] = (function(ahead)[0] - function(behind)[0]) / (2 * step)
    return slopes


def error(function: Function, x: Array) -> float:
    """Largest difference of the gradient from central differences, relative to the largest of these."""
    gradient, slopes = function(x)[1], differences(function, x)
    return float(np.abs(gradient - slopes).max() / np.abs(slopes).max())
