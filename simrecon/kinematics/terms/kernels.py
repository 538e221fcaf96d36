"""Pure functions that terms share: a loss, and its gradient by the first argument.

Points are (M, T, 3). The losses are sums; terms multiply them by the frame interval, so that the loss of a
clip does not depend on its frame rate.
"""

from __future__ import annotations

import numpy as np

from simrecon.types import Array

# Below it the speed of `travel` is rounded off, m/s or rad/s of all values together.
LEAST_SPEED = 0.01


def cauchy(squared: Array) -> tuple[Array, Array]:
    """Robust kernel log(1 + r²) of squared, normalised residuals, and its derivative with respect to r²."""
    return np.log1p(squared), 1.0 / (1.0 + squared)


def distance(points_m: Array, targets_m: Array, weights: Array, sigma: float) -> tuple[float, Array]:
    """Robust distance between points and targets, (M, T, 3) both; weights (M, T)."""
    residual = (points_m - targets_m) / sigma
    loss, slope = cauchy(np.sum(residual**2, axis=-1))
    return float(np.sum(weights * loss)), (2 * weights * slope)[..., None] * residual / sigma


def acceleration(values: Array, interval_s: float, sigma: float) -> tuple[float, Array]:
    """Squared second differences of values (M, T, C) over time; sigma in units of `values` per s²."""
    second = (values[:, 2:] - 2 * values[:, 1:-1] + values[:, :-2]) / (interval_s**2 * sigma)
    gradient = np.zeros_like(values)
    gradient[:, 2:] += second
    gradient[:, 1:-1] -= 2 * second
    gradient[:, :-2] += second
    return float(np.sum(second**2)), gradient * (2 / (interval_s**2 * sigma))


def speeds(values: Array, interval_s: float) -> Array:
    """Norm of the velocities of all values (M, T, C) together, (T - 1,), rounded off near zero."""
    step = np.diff(values, axis=1) / interval_s
    return np.asarray(np.sqrt(np.sum(step**2, axis=(0, 2)) + LEAST_SPEED**2))


def travel(values: Array, interval_s: float) -> tuple[float, Array]:
    """Speed of all values (M, T, C) together, summed over frames (Gärtner 2022, eq. 8)."""
    speed = speeds(values, interval_s)
    g = np.diff(values, axis=1) / (interval_s**2 * speed[:, None])
    gradient = np.zeros_like(values)
    gradient[:, 1:] += g
    gradient[:, :-1] -= g
    return float(np.sum(speed)), gradient


def still(points_m: Array, interval_s: float, sigma: float) -> tuple[float, Array]:
    """Robust speed of points (M, T, 3): what moves slowly is held still, what moves fast is left alone.

    Args:
        points_m: (M, T, 3).
        interval_s: between frames.
        sigma: speed at which the hold begins to fade, m/s.
    """
    step = np.diff(points_m, axis=1) / (interval_s * sigma)  # (M, T - 1, 3)
    loss, slope = cauchy(np.sum(step**2, axis=-1))
    g = 2 * slope[..., None] * step / (interval_s * sigma)
    gradient = np.zeros_like(points_m)
    gradient[:, 1:] += g
    gradient[:, :-1] -= g
    return float(np.sum(loss)), gradient


def outside(values: Array, low: Array, high: Array, sigma: float) -> tuple[float, Array]:
    """Squared amount by which values leave [low, high]."""
    excess = (np.maximum(values - high, 0.0) - np.maximum(low - values, 0.0)) / sigma
    return float(np.sum(excess**2)), 2 * excess / sigma


def held(points_m: Array, weights: Array, interval_s: float, sigma: float) -> tuple[float, Array]:
    """Squared speed of points in contact, as Rempe 2020 eq. B6.

    Args:
        points_m: (M, T, 3).
        weights: (M, T - 1) of each step from a frame to the next.
        interval_s: between frames.
        sigma: speed that costs one, m/s.
    """
    step = np.diff(points_m, axis=1) / (interval_s * sigma)  # (M, T - 1, 3)
    g = 2 * weights[..., None] * step / (interval_s * sigma)
    gradient = np.zeros_like(points_m)
    gradient[:, 1:] += g
    gradient[:, :-1] -= g
    return float(np.sum(weights[..., None] * step**2)), gradient


def near(values: Array, targets: Array, weights: Array | float, sigma: float) -> tuple[float, Array]:
    """Weighted squared distance of values from targets, all of one shape."""
    residual = (values - targets) / sigma
    return float(np.sum(weights * residual**2)), 2 * weights * residual / sigma
