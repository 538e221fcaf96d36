"""What keeps a plan steady: a wrench that changes slowly (after Xie 2021, eq. 7), and the place of the fit.

    S = Σ_t (√(1 + ‖(w_{t+1} - w_t) / (σ_r Δt)‖²) - 1) + Σ_t ½ ‖(c_t - c°_t) / σ_p‖²

Forces are no unknowns here, so what is held is the wrench w that they have to explain, force in body weights
and moment in that times stature; a landing, which is a step, counts by its height and not by its square.
A pose that leans a little too far asks for a horizontal force, and this, twice integrated, for a place that
is decimetres off, which one camera hardly sees in depth: so the centre of mass c stays near the fit's, c°.
"""

from __future__ import annotations

import numpy as np

from simrecon.types import Array


def rate(wrench: Array, unit: float) -> tuple[float, Array]:
    """The first sum, and its slope by the wrench.

    Args:
        wrench: (n, 6) w.
        unit: σ_r Δt, of its change from frame to frame.

    Returns:
        The sum, and (n, 6).
    """
    change = np.diff(wrench, axis=0) / unit
    size = np.sqrt(1.0 + np.sum(change**2, axis=1))
    pull = change / (size[:, None] * unit)
    slope = np.zeros_like(wrench)
    slope[1:] += pull
    slope[:-1] -= pull
    return float(np.sum(size - 1.0)), slope


def rate_curvature(unit: float) -> float:
    """A bound on the curvature of `rate` by the wrench of a frame: (a - b)² is at most 2 a² + 2 b²."""
    return 4.0 / unit**2


def place(com_m: Array, fit_m: Array, unit_m: float) -> tuple[float, Array]:
    """The second sum, and its slope by the centres of mass (T, 3)."""
    off = (com_m - fit_m) / unit_m
    return 0.5 * float(np.sum(off**2)), off / unit_m
