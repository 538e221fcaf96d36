"""Curves of cubic Hermite polynomials in CasADi's symbols (Rempe 2020, C.1; Winkler 2018).

A node has a value and a velocity; a piece goes from one node to the next. With s = (t - start) / length

    x(t) = (1 - 3s² + 2s³) x₀ + (s - 2s² + s³) h v₀ + (3s² - 2s³) x₁ + (s³ - s²) h v₁
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from simrecon.types import Array, IntArray

Symbols = Any
"""Of CasADi, which has no types: SX, one row for each time or node."""
AXES = 3


@dataclass(eq=False)
class Unknowns:
    """Unknowns of a program in order, with where the search begins."""

    symbols: list[Symbols] = field(default_factory=list)
    starts: list[Array] = field(default_factory=list)

    def new(self, name: str, start: Array) -> Symbols:
        """Rows (K, 3) of unknowns that begin at `start`."""
        rows = np.atleast_2d(start)
        made = ca.SX.sym(name, *rows.shape)
        self.symbols.append(ca.vec(made))
        self.starts.append(rows.ravel(order="F"))
        return made

    @property
    def count(self) -> int:
        """How many numbers they are."""
        return sum(len(start) for start in self.starts)


@dataclass(eq=False)
class Curve:
    """A curve of K nodes and n pieces.

    Attributes:
        values, rates: (K, 3) symbols or numbers.
        first, last: (n,) node at which each piece begins and ends.
        starts, lengths: (n,) when each piece begins, and how long it is: symbols or numbers.
        edges_s: (n + 1,) the ends as numbers, by which a time finds its piece.
    """

    values: Symbols
    rates: Symbols
    first: IntArray
    last: IntArray
    starts: Symbols
    lengths: Symbols
    edges_s: Array

    def piece(self, times_s: Array) -> IntArray:
        """The piece of each time (N,)."""
        rows = np.searchsorted(self.edges_s, times_s + 1e-9, side="right") - 1
        return np.asarray(np.clip(rows, 0, len(self.first) - 1))

    def at(self, times_s: Array, order: int = 0, pieces: IntArray | None = None) -> Symbols:
        """The curve, its velocity or its acceleration at times (N,), (N, 3); pieces: (N,) to use there."""
        rows = self.piece(times_s) if pieces is None else pieces
        h = self.lengths[rows.tolist(), :]
        s = (ca.DM(times_s) - self.starts[rows.tolist(), :]) / h
        before, after = self.first[rows].tolist(), self.last[rows].tolist()
        weights = _weights(s, h, order)
        nodes = (self.values[before, :], self.rates[before, :], self.values[after, :], self.rates[after, :])
        total = 0
        for weight, node in zip(weights, nodes, strict=True):
            total = total + ca.repmat(weight, 1, AXES) * node
        return total


def _weights(s: Symbols, h: Symbols, order: int) -> tuple[Symbols, Symbols, Symbols, Symbols]:
    """Of value and velocity at the beginning, and at the end, of a piece."""
    if order == 0:
        rise = s * s * (3 - 2 * s)
        return 1 - rise, s * (1 - s) ** 2 * h, rise, s * s * (s - 1) * h
    if order == 1:
        steep = 6 * s * (1 - s) / h
        return -steep, 1 - 4 * s + 3 * s * s, steep, 3 * s * s - 2 * s
    bend = (6 - 12 * s) / (h * h)
    return -bend, (6 * s - 4) / h, bend, (6 * s - 2) / h


def even(unknowns: Unknowns, name: str, duration_s: float, spacing_s: float, place: Sampled) -> Curve:
    """Pieces of one length, near `spacing_s`, all of whose nodes are unknown."""
    count = max(1, round(duration_s / spacing_s))
    edges = np.linspace(0.0, duration_s, count + 1)
    values = unknowns.new(name, place.at(edges))
    rates = unknowns.new(f"{name}_rate", place.rate(edges))
    rows = np.arange(count)
    return Curve(values, rates, rows, rows + 1, ca.DM(edges[:-1]), ca.DM(np.diff(edges)), edges)


@dataclass(eq=False)
class Samples:
    """Curves at times as symbols of their own: laws are simple in these, and they are simple in the unknowns.

    Attributes:
        symbols: columns; values: what they stand for, in the unknowns.
    """

    symbols: list[Symbols] = field(default_factory=list)
    values: list[Symbols] = field(default_factory=list)

    def of(self, curve: Curve, times_s: Array, order: int = 0, pieces: IntArray | None = None) -> Symbols:
        """As `Curve.at`."""
        value = ca.SX(curve.at(times_s, order, pieces))
        made = ca.SX.sym("sample", *value.shape)
        self.symbols.append(ca.vec(made))
        self.values.append(ca.vec(value))
        return made


@dataclass(frozen=True, eq=False)
class Sampled:
    """Samples (T, 3) at times (T,), by which a search begins."""

    times_s: Array
    values: Array

    def at(self, times_s: Array) -> Array:
        """At other times (N,), (N, 3)."""
        return np.stack([np.interp(times_s, self.times_s, column) for column in self.values.T], axis=1)

    def mean(self, start_s: float, end_s: float) -> Array:
        """Their mean in an interval, (3,)."""
        return np.asarray(self.at(np.linspace(start_s, end_s, 9)).mean(axis=0))

    def rate(self, times_s: Array) -> Array:
        """Velocity there."""
        return Sampled(self.times_s, np.gradient(self.values, self.times_s, axis=0)).at(times_s)


@dataclass(eq=False)
class Nodes:
    """Nodes and pieces of a curve of phases, as they are added."""

    values: list[Symbols] = field(default_factory=list)
    rates: list[Symbols] = field(default_factory=list)
    pieces: list[tuple[int, int]] = field(default_factory=list)

    def add(self, value: Symbols, rate: Symbols) -> int:
        """A node (1, 3), by number."""
        self.values.append(value)
        self.rates.append(rate)
        return len(self.values) - 1

    def chain(self, nodes: list[int]) -> None:
        """Pieces from each node to the next."""
        self.pieces.extend(pairwise(nodes))

    def curve(self, edges: Symbols, edges_s: Array) -> Curve:
        """Between edges (n + 1,), as symbols and as numbers."""
        first, last = np.array(self.pieces).T
        values, rates = ca.vertcat(*self.values), ca.vertcat(*self.rates)
        return Curve(values, rates, first, last, edges[:-1], edges[1:] - edges[:-1], edges_s)
