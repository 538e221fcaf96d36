"""The covariance of CMA-ES's steps: diagonal, at linear cost, or full.

Source: N. Hansen, "The CMA Evolution Strategy: A Tutorial", arXiv 1604.00772, whose equation numbers are
given below. Axes: P samples of a generation, n variables.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from simrecon.types import Array

Covariance = Literal["diagonal", "full"]
State = dict[str, Array | float | int | str]

SMALLEST = 1e-200
"""Keeps variances of a run finite that goes on long after it converged."""

_CONDITION_LIMIT = 1e14


class Diagonal:
    """Diagonal covariance C of the steps, kept as standard deviations (n,)."""

    def __init__(self, deviations: Array) -> None:
        self.deviations = deviations

    def colour(self, normal: Array) -> Array:
        """Steps (…, n) of standard normal samples (…, n)."""
        return normal * self.deviations  # (…, n) eq. 39

    def whiten(self, steps: Array) -> Array:
        """C^-1/2 y of steps y (…, n)."""
        return steps / self.deviations  # (…, n)

    def update(self, keep: float, c_1: float, path: Array, weights: Array, steps: Array) -> None:
        """Diagonal of eq. 47.

        Eq. 52 would keep C positive whatever is sampled, but with hundreds of variables it leaves next to
        nothing of the negative weights. Here each variance stays above half of what the positive terms give.

        Args:
            keep: factor on the old C.
            c_1: learning rate of the path.
            path: (n,).
            weights: (P,) with the factor c_mu.
            steps: (P, n), best first.
        """
        mu = int(np.count_nonzero(weights > 0))
        squares = steps * steps  # (P, n)
        grown = keep * self.deviations**2 + c_1 * path**2 + weights[:mu] @ squares[:mu]  # (n,)
        variance = np.maximum(grown + weights[mu:] @ squares[mu:], 0.5 * grown)  # (n,)
        self.deviations = np.sqrt(np.maximum(variance, SMALLEST))  # (n,)

    def state(self) -> State:
        """What `restored` needs."""
        return {"deviations": self.deviations.copy()}


class Full:
    """Full C = B D² Bᵀ; B and D may be `gap` generations old, tutorial B.2."""

    def __init__(self, matrix: Array, basis: Array, roots: Array, *, age: int, rate: float) -> None:
        self._matrix, self._basis, self._roots = matrix, basis, roots  # (n, n), (n, n), (n,)
        self._age, self._gap = age, max(1, int(1 / (10 * roots.size * rate)))  # B.2

    def colour(self, normal: Array) -> Array:
        """Steps (…, n) of standard normal samples (…, n)."""
        return (normal * self._roots) @ self._basis.T  # (…, n) eq. 39

    def whiten(self, steps: Array) -> Array:
        """C^-1/2 y of steps y (…, n)."""
        return ((steps @ self._basis) / self._roots) @ self._basis.T  # (…, n)

    def update(self, keep: float, c_1: float, path: Array, weights: Array, steps: Array) -> None:
        """Eq. 47; the arguments are those of `Diagonal.update`."""
        rank_mu = (steps.T * weights) @ steps  # (n, n)
        matrix = keep * self._matrix + c_1 * np.outer(path, path) + rank_mu  # (n, n)
        self._matrix = 0.5 * (matrix + matrix.T)  # (n, n)
        self._age += 1
        if self._age >= self._gap:
            self._decompose()

    def _decompose(self) -> None:
        values, self._basis = np.linalg.eigh(self._matrix)  # (n,), (n, n)
        floor = max(values[-1] / _CONDITION_LIMIT, SMALLEST)
        if values[0] < floor:
            values = np.maximum(values, floor)
            matrix = (self._basis * values) @ self._basis.T  # (n, n)
            self._matrix = 0.5 * (matrix + matrix.T)  # (n, n)
        self._roots = np.sqrt(values)  # (n,)
        self._age = 0

    @property
    def deviations(self) -> Array:
        """Standard deviations (n,) of the steps."""
        return np.sqrt(np.maximum(np.diagonal(self._matrix), 0.0))  # (n,)

    def state(self) -> State:
        """What `restored` needs."""
        arrays = {"matrix": self._matrix, "basis": self._basis, "roots": self._roots}
        return {**{key: array.copy() for key, array in arrays.items()}, "age": self._age}


def identity(kind: Covariance, n: int, rate: float) -> Diagonal | Full:
    """C = 1 for n variables; `rate` = c_1 + c_mu says how often a full one is decomposed (B.2)."""
    if kind == "diagonal":
        return Diagonal(np.ones(n))
    return Full(np.eye(n), np.eye(n), np.ones(n), age=0, rate=rate)


def restored(kind: Covariance, state: Mapping[str, Any], rate: float) -> Diagonal | Full:
    """The covariance of a `state`; `rate` as in `identity`."""
    if kind == "diagonal":
        return Diagonal(np.array(state["deviations"], dtype=np.float64))
    arrays = (np.array(state[key], dtype=np.float64) for key in ("matrix", "basis", "roots"))
    return Full(*arrays, age=int(state["age"]), rate=rate)
