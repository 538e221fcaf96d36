"""Terms of the kinematic objective: pure functions that return a loss and its gradient by the first argument.

Points are (M, T, 3). Terms are sums; the objective multiplies them by the frame interval, so that a clip's
loss does not depend on its frame rate.
"""

from __future__ import annotations

import numpy as np

from simrecon.types import Array

# From this certainty on a foot counts as support.
STANDS = 0.3
# Below it the speed of `travel` is rounded off, m/s or rad/s of all values together.
LEAST_SPEED = 0.01


def cauchy(squared: Array) -> tuple[Array, Array]:
    """Robust kernel log(1 + r²) of squared, normalised residuals, and its derivative with respect to r²."""
    return np.log1p(squared), 1.0 / (1.0 + squared)


def reprojection(
    points_m: Array, rays: Array, weights: Array, world_to_camera: Array, sigma: float
) -> tuple[float, Array]:
    """Distance in the ideal image plane between projected points and undistorted detections, robust.

    Args:
        points_m: (M, T, 3) world.
        rays: (M, T, 2) detections as x/z, y/z.
        weights: (M, T), zero where not seen.
        world_to_camera: (4, 4) or (T, 4, 4).
        sigma: distance at which a detection counts half, in the units of `rays`.
    """
    rotation, translation = world_to_camera[..., :3, :3], world_to_camera[..., :3, 3]
    xyz = (rotation @ points_m[..., None])[..., 0] + translation  # (M, T, 3)
    depth = np.maximum(xyz[..., 2:], 0.1)
    residual = (xyz[..., :2] / depth - rays) / sigma  # (M, T, 2)
    loss, slope = cauchy(np.sum(residual**2, axis=-1))
    d_image = (2 * weights * slope)[..., None] * residual / sigma  # (M, T, 2)
    d_depth = np.where(
        xyz[..., 2:] > 0.1, -np.sum(d_image * xyz[..., :2], axis=-1, keepdims=True) / depth**2, 0.0
    )
    d_camera = np.concatenate((d_image / depth, d_depth), axis=-1)  # (M, T, 3)
    return float(np.sum(weights * loss)), (np.swapaxes(rotation, -1, -2) @ d_camera[..., None])[..., 0]


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


def penetration(clearance_m: Array, sigma: float) -> tuple[float, Array]:
    """Squared depth inside a thing; clearances of any shape, negative inside."""
    depth = np.maximum(-clearance_m, 0.0) / sigma
    return float(np.sum(depth**2)), -2 * depth / sigma


def balance(
    com_m: Array, feet_m: Array, standing: Array, borne: Array, interval_s: float, sigma: float
) -> tuple[float, Array, Array, Array]:
    """Distance of the zero-moment point from the support of the standing feet, robust.

    The ground can only push where the person stands: the point c_xy - c_z c̈_xy / g (Vukobratović 1972, for a
    body that does not spin) lies within the feet, or on the line between them. It ties the trunk, whose depth
    one camera hardly sees, to the feet, whose depth the floor gives.

    Args:
        com_m: (T, 3) centre of mass, heights over the floor.
        feet_m: (2, T, 3) middle of the left and the right sole.
        standing: (2, T) how surely each foot stands, 0 to 1; frames without one don't count.
        borne: (T,) how surely nothing but the feet bears the person, 0 to 1.
        interval_s: between frames.
        sigma: distance at which the pull begins to fade, about half the length of a foot. A margin
            without any pull, and a stiff one beyond, would be as right, but hard to search.

    Returns:
        The loss and its gradients, (T, 3) of the centre of mass, (2, T, 3) of the feet, (T,) of `borne`.
    """
    g = 9.81
    acceleration = (com_m[2:, :2] - 2 * com_m[1:-1, :2] + com_m[:-2, :2]) / interval_s**2  # (T - 2, 2)
    height = com_m[1:-1, 2:]
    point = com_m[1:-1, :2] - height * acceleration / g  # (T - 2, 2)
    left, right = feet_m[:, 1:-1, :2]
    sure = standing[:, 1:-1]
    across = right - left
    along = np.sum((point - left) * across, axis=-1) / np.maximum(np.sum(across**2, axis=-1), 1e-9)
    low, high = np.where(sure[0] < STANDS, 1.0, 0.0), np.where(sure[1] < STANDS, 0.0, 1.0)
    share = np.clip(along, np.minimum(low, high), np.maximum(low, high))[
        :, None
    ]  # (T - 2, 1) 0 left, 1 right
    offset = point - (1 - share) * left - share * right  # (T - 2, 2)
    loss, slope = cauchy(np.sum(offset**2, axis=-1) / sigma**2)
    sure_of = np.where((sure >= STANDS).any(axis=0), sure.max(axis=0), 0.0)
    weight = sure_of * borne[1:-1]
    d_borne = np.zeros(len(com_m))
    d_borne[1:-1] = sure_of * loss
    d_point = (2 * weight * slope / sigma**2)[:, None] * offset  # (T - 2, 2)
    d_com, d_feet = np.zeros_like(com_m), np.zeros_like(feet_m)
    lever = d_point * -height / (g * interval_s**2)
    d_com[1:-1, :2] += d_point - 2 * lever
    d_com[2:, :2] += lever
    d_com[:-2, :2] += lever
    d_com[1:-1, 2] -= np.sum(d_point * acceleration, axis=-1) / g
    d_feet[0, 1:-1, :2] = -(1 - share) * d_point
    d_feet[1, 1:-1, :2] = -share * d_point
    return float(np.sum(weight * loss)), d_com, d_feet, d_borne


def touching(clearance_m: Array, sigma: float, weights: Array | float = 1.0) -> tuple[float, Array]:
    """Pull of points to their support, fading with distance (in the manner of Gärtner 2022 eq. 6).

    Args:
        clearance_m: signed distances, any shape.
        sigma: distance at which the pull begins to fade.
        weights: of the same shape, or one for all.
    """
    squared = (clearance_m / sigma) ** 2
    loss = float(np.sum(weights * squared / (1 + squared)))
    return loss, weights * 2 * clearance_m / sigma**2 / (1 + squared) ** 2


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
