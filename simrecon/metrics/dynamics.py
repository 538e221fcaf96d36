"""Forces, torques and power, as pure functions of arrays; docs/metrics.md sets the variants apart.

Axes: T frames, F feet, K joints; leading axes are batches. Per cent of body weight = 100 · force / (mass ·
g).
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from simrecon.contact.rules import LOADED_N
from simrecon.types import Array, Flags

GRAVITY_MPS2 = 9.81
UP_MPS2 = np.array([0.0, 0.0, GRAVITY_MPS2])


def body_weight_pct(force_N: Array, mass_kg: float) -> Array:
    """Force in percent of body weight."""
    return np.asarray(100.0 * force_N / (mass_kg * GRAVITY_MPS2))


def implied_grf(com_m: Array, mass_kg: float, interval_s: float) -> Array:
    """The force that a kinematic motion asks of the ground, N, (..., T, 3) → (..., T - 2, 3).

    Rempe 2020, section 4.3: m (c̈ + g), with the acceleration of the centre of mass by second differences;
    entry i belongs to frame i + 1. All frames count, in contact or not: a ballistic motion asks for nothing.
    """
    com_acc = np.diff(com_m, 2, axis=-2) / interval_s**2  # (..., T-2, 3)
    return np.asarray(mass_kg * (com_acc + UP_MPS2))


def needed_load(com_height_m: Array, interval_s: float, smooth_s: float) -> Array:
    """Upward force that a motion needs, in body weights, (T,) → (T,): 1 + z̈ / g.

    The height z of the centre of mass is smoothed by a Gaussian of deviation `smooth_s` first; central
    differences of central differences. Both are unsure within two deviations of the ends.
    """
    smooth = gaussian_filter1d(com_height_m, smooth_s / interval_s, mode="nearest")
    return np.asarray(1 + np.gradient(np.gradient(smooth, interval_s), interval_s) / GRAVITY_MPS2)


def interval_means(ends_s: Array, values: Array, times_s: Array) -> Array:
    """Means over other intervals than those that were averaged over, (T, ...) → (N - 1, ...).

    The integral is kept: forces of a fine time base come out as on a coarser one, whatever their rate.

    Args:
        ends_s: (T,) not decreasing; ends of the intervals, the first of which has no length.
        values: (T, ...) mean since the end before.
        times_s: (N,) increasing; ends of the other intervals, within `ends_s`.
    """
    lengths = np.diff(ends_s, prepend=ends_s[0])  # (T,)
    total = np.cumsum(values.reshape(len(values), -1) * lengths[:, None], axis=0)  # (T, ...)
    at_ends = np.stack([np.interp(times_s, ends_s, column) for column in total.T], axis=-1)
    means = np.diff(at_ends, axis=0) / np.diff(times_s)[:, None]
    return np.asarray(means.reshape(len(times_s) - 1, *values.shape[1:]))


def grf_norm_pct(force_N: Array, mass_kg: float) -> Array:
    """Norm of the force, percent of body weight, (..., T, 3) → (..., T).

    Rempe 2020 table 2, "a percentage of the GRF exerted by an idle 73 kg person", forces at 30 frames a
    second. Mean GRF is its mean: not the norm of the mean force, which is 100 for any motion that begins and
    ends at the same velocity, however it jitters; their jittering input has 143. Max GRF is its maximum: an
    impact is the higher the shorter the time over which its force is averaged.
    """
    return np.asarray(np.linalg.norm(body_weight_pct(force_N, mass_kg), axis=-1))


def ballistic_grf_pct(norm_pct: Array, flight: Flags) -> float:
    """Ballistic GRF: median norm of the force while nothing should touch, percent of body weight.

    Rempe 2020 table 2: "median GRF on the COM when no feet joints should be in contact according to ground
    truth labels". NaN without flight.

    Args:
        norm_pct: (T,) from `grf_norm_pct`.
        flight: (T,) frames in which the reference touches nothing.
    """
    return float(np.median(norm_pct[flight])) if flight.any() else float("nan")


def correlation(a: Array, b: Array) -> float:
    """Pearson correlation of two series (T,) where both are known; NaN if one of them is constant."""
    known = np.isfinite(a) & np.isfinite(b)
    if known.sum() < 2:
        return float("nan")
    x, y = a[known] - a[known].mean(), b[known] - b[known].mean()
    norm = float(np.linalg.norm(x) * np.linalg.norm(y))
    return float(x @ y) / norm if norm > 0 else float("nan")


def centre_of_pressure_error(
    centre_m: Array, measured_m: Array, force_N: Array, measured_N: Array, loaded_N: float = LOADED_N
) -> float:
    """Mean horizontal distance of centres of pressure where both are loaded, m; NaN if they never are.

    Args:
        centre_m: (T, F, 3).
        measured_m: (T, F, 3).
        force_N: (T, F) vertical.
        measured_N: (T, F) vertical.
        loaded_N: from which a foot counts as loaded.
    """
    distance = np.linalg.norm((centre_m - measured_m)[..., :2], axis=-1)  # (T, F)
    loaded = (force_N > loaded_N) & (measured_N > loaded_N) & np.isfinite(distance)
    return float(distance[loaded].mean()) if loaded.any() else float("nan")


def joint_power(torque_Nm: Array, rate_radps: Array) -> Array:
    """Power of each joint, W: torque times angular velocity, both (..., T, 3 K) → (..., T, K)."""
    product = torque_Nm * rate_radps
    return np.asarray(product.reshape(*product.shape[:-1], -1, 3).sum(-1))


def peak_torque(torque_Nm: Array, mass_kg: float) -> float:
    """Greatest torque of a joint per body mass, Nm/kg: norm of its three components, (T, 3 K)."""
    norms = np.linalg.norm(torque_Nm.reshape(len(torque_Nm), -1, 3), axis=-1)
    return float(norms.max()) / mass_kg


def peak_power(torque_Nm: Array, rate_radps: Array, mass_kg: float) -> float:
    """Greatest power, in or out, of a joint per body mass, W/kg; arguments as in `joint_power`, (T, 3 K)."""
    return float(np.abs(joint_power(torque_Nm, rate_radps)).max()) / mass_kg


def residual_pct(com_velocity_mps: Array, force_N: Array, mass_kg: float, interval_s: Array | float) -> Array:
    """Force on the body that contact does not explain, percent of body weight, (..., T, 3) → (..., T - 1).

    ‖m (Δċ/Δt + g) − F‖ over each interval, with F the mean force in it. Hicks et al. 2015 ask for residuals
    below 5 % of the peak external force; a simulation has what its time steps leave.

    Args:
        com_velocity_mps: (..., T, 3) velocity of the centre of mass at the frames.
        force_N: (..., T, 3) mean of all contact forces since the frame before.
        mass_kg: of the person.
        interval_s: between frames, () or (T - 1,).
    """
    com_acc = np.diff(com_velocity_mps, axis=-2) / np.asarray(interval_s)[..., None]  # (..., T-1, 3)
    residual = mass_kg * (com_acc + UP_MPS2) - force_N[..., 1:, :]
    return np.asarray(np.linalg.norm(body_weight_pct(residual, mass_kg), axis=-1))
