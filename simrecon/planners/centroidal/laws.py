"""Constraints, and how they are told apart."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from simrecon.metrics.dynamics import GRAVITY_MPS2
from simrecon.planners.centroidal.curves import Curve, Symbols
from simrecon.types import Array


@dataclass(eq=False)
class Law:
    """Constraints of one kind: low ≤ values ≤ high.

    Attributes:
        name: for messages; unit: of its values there.
        values: column of symbols.
        low, high: numbers, for all of them or for each.
        times_s: (n,) of each value.
        price: of a unit by which it is broken, where constraints may give way.
    """

    name: str
    values: Symbols
    low: Array
    high: Array
    times_s: Array
    price: float = np.inf


def law(name: str, values: Symbols, low: float, high: float, times_s: Array, price: float = np.inf) -> Law:
    """One whose bounds are those of all values; values (N, k) at times (N,)."""
    column = ca.vec(values)
    count = column.shape[0]
    times = np.tile(times_s, max(count // max(len(times_s), 1), 1))
    return Law(name, column, np.full(count, low), np.full(count, high), times, price)


def grid(duration_s: float, spacing_s: float) -> Array:
    """Times at which constraints are taken: both ends, and evenly between them."""
    return np.linspace(0.0, duration_s, max(1, round(duration_s / spacing_s)) + 1)


def interpolated(times_s: Array, values: Array, at_s: Array) -> Array:
    """Values (T, k) at other times (N,), (N, k)."""
    return np.stack([np.interp(at_s, times_s, column) for column in values.T], axis=1)


def smooth(curve: Curve) -> Law:
    """Accelerations do not jump from one cubic to the next (Winkler 2018)."""
    edges = curve.edges_s[1:-1]
    rows = np.arange(len(edges))
    before, after = curve.at(edges, 2, rows), curve.at(edges, 2, rows + 1)
    return law("smoothness", (after - before) / GRAVITY_MPS2, 0.0, 0.0, edges)
