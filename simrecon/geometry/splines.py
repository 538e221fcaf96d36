"""Uniform cubic B-splines for control targets.

All knots of a clip lie on one grid with the spacing h: the basis of knot q is centred at (q - 1) h, rises
from (q - 3) h and falls to zero at (q + 1) h. So knot 0 is centred one spacing before time 0, four knots act
at any time, and windows that overlap share the knots of their overlap. With Q knots the spline is defined
(the basis sums to one) over [0, (Q - 3) h].
"""

from __future__ import annotations

import math

import numpy as np

from simrecon.types import Array

# A time that is off the grid by less than this part of a spacing lies on the grid: n * dt is rarely exact.
_ON_GRID = 1e-9


def knot_count(duration_s: float, spacing_s: float) -> int:
    """Knots that define the spline over [0, duration_s].

    Raises:
        ValueError: a negative duration or a spacing that is not positive.
    """
    _check_spacing(spacing_s)
    if not (duration_s >= 0 and math.isfinite(duration_s)):
        raise ValueError(f"duration_s: {duration_s}; valid is a finite number >= 0")
    return math.ceil(_snapped(duration_s / spacing_s)) + 3


def knot_times(duration_s: float, spacing_s: float) -> Array:
    """Centres (Q,) in seconds of the knots that `knot_count` counts; the first is -spacing_s."""
    knots = np.arange(knot_count(duration_s, spacing_s), dtype=np.float64)  # (Q,)
    return (knots - 1.0) * spacing_s


def basis(times_s: Array, spacing_s: float, count: int, start_s: float = 0.0) -> Array:
    """Values of the basis: the spline at `times_s` is `basis(...) @ knots`.

    The rows are not negative and sum to one; as functions of time the columns have two continuous
    derivatives. It is the cardinal cubic B-spline, C. de Boor, "A Practical Guide to Splines", chapter IX.

    Args:
        times_s: (N,), each in [start_s, start_s + (count - 3) spacing_s].
        spacing_s: knot spacing h.
        count: number of knots, at least 3 (3 define a single instant).
        start_s: left end of the valid interval, (first knot) · h for a slice that `support` gave.

    Returns:
        (N, count).

    Raises:
        ValueError: a time outside the interval, or an argument that can't be used.
    """
    _check_spacing(spacing_s)
    if count < 3:
        raise ValueError(f"count: {count}; valid is 3 or more")
    times_s = np.asarray(times_s, dtype=np.float64)
    if times_s.ndim != 1:
        raise ValueError(f"times_s: shape {times_s.shape}; valid is (N,)")
    phase = (times_s - start_s) / spacing_s  # (N,) in spacings
    slack = _ON_GRID * (1.0 + count)
    if not ((phase >= -slack) & (phase <= count - 3 + slack)).all():
        end_s = start_s + (count - 3) * spacing_s
        raise ValueError(
            f"times_s: from {times_s.min():.6g} to {times_s.max():.6g}; valid is [{start_s:.6g}, {end_s:.6g}]"
        )
    phase = np.clip(phase, 0.0, count - 3.0)  # (N,)
    distance = np.abs(phase[:, None] - (np.arange(count) - 1.0))  # (N, count)
    outer = np.maximum(2.0 - distance, 0.0)  # (N, count)
    inner = np.maximum(1.0 - distance, 0.0)  # (N, count)
    return (outer**3 - 4.0 * inner**3) / 6.0  # (N, count)


def support(first_time_s: float, last_time_s: float, spacing_s: float) -> slice:
    """Knots of the global grid whose basis is not zero somewhere in [first_time_s, last_time_s].

    Args:
        first_time_s: at least 0, where the grid starts.
        last_time_s: not before `first_time_s`.
        spacing_s: knot spacing h.

    Returns:
        A slice `knots`: `basis(times, h, knots.stop - knots.start, knots.start * h)` covers the interval.

    Raises:
        ValueError: an interval that starts before 0 or ends before it starts.
    """
    _check_spacing(spacing_s)
    if not (0 <= first_time_s <= last_time_s < math.inf):
        interval = f"interval [{first_time_s}, {last_time_s}]"
        raise ValueError(f"{interval}; valid is 0 <= first_time_s <= last_time_s")
    first = math.floor(_snapped(first_time_s / spacing_s))
    return slice(first, math.ceil(_snapped(last_time_s / spacing_s)) + 3)


def _snapped(phase: float) -> float:
    """`phase`, or the whole number that it differs from by rounding only."""
    nearest = round(phase)
    return float(nearest) if abs(phase - nearest) <= _ON_GRID * max(1.0, abs(phase)) else phase


def _check_spacing(spacing_s: float) -> None:
    if not (spacing_s > 0 and math.isfinite(spacing_s)):
        raise ValueError(f"spacing_s: {spacing_s}; valid is a positive finite number")
