"""The covariance of CMA-ES's steps: diagonal or diagonal and low rank, at linear cost, or full.

Source: N. Hansen, "The CMA Evolution Strategy: A Tutorial", arXiv 1604.00772, whose equation numbers stand
at the lines that implement them; for low rank Y. Akimoto and N. Hansen, "Projection-Based Restricted
Covariance Matrix Adaptation for High Dimension", GECCO 2016 (VkD-CMA). Axes: P samples of a generation,
n variables, k directions.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from simrecon.types import Array

Covariance = Literal["diagonal", "low_rank", "full"]

SMALLEST = 1e-200
"""Keeps variances above zero when a run goes on long after it converged."""

RANK = 4
"""Directions of a low-rank covariance; 1 and 16 did about as well in 30 generations (decision 9)."""

_CONDITION_LIMIT = 1e14


class Diagonal:
    """Diagonal covariance C of the steps, kept as standard deviations (n,)."""

    def __init__(self, n: int) -> None:
        self._deviations = np.ones(n)

    def colour(self, normal: Array) -> Array:
        """Steps (…, n) of standard normal samples (…, n)."""
        return normal * self._deviations  # (…, n) eq. 39

    def whiten(self, steps: Array) -> Array:
        """C^-1/2 y of steps y (…, n)."""
        return steps / self._deviations  # (…, n)

    def distance2(self, steps: Array) -> Array:
        """yᵀ C⁻¹ y (P,) of steps y (P, n)."""
        squares: Array = np.square(steps) @ (1 / np.square(self._deviations))  # (P,)
        return squares

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
        squares = np.square(steps)  # (P, n)
        grown = keep * self._deviations**2 + c_1 * path**2 + weights[:mu] @ squares[:mu]  # (n,)
        variance = np.maximum(grown + weights[mu:] @ squares[mu:], 0.5 * grown)  # (n,)
        self._deviations = np.sqrt(np.maximum(variance, SMALLEST))  # (n,)


class LowRank:
    """C = D (1 + E diag(a) Eᵀ) D, Akimoto and Hansen 2016 eq. 5, at a cost of O(n k) a sample.

    D is diagonal, the k rows of Eᵀ are orthonormal and a >= 0. C's factor A = D (1 + E diag(a) Eᵀ)^½ isn't
    symmetric, which changes no distribution, and turns the path of the step size only as slowly as D changes.
    """

    def __init__(self, n: int) -> None:
        k = rank(n)
        self._scales, self._axes, self._excess = np.ones(n), np.eye(k, n), np.zeros(k)

    def colour(self, normal: Array) -> Array:
        """Steps (…, n) of standard normal samples (…, n)."""
        along = (normal @ self._axes.T) * (np.sqrt(1 + self._excess) - 1)  # (…, k)
        steps: Array = along @ self._axes  # (…, n)
        steps += normal
        steps *= self._scales  # (…, n) eq. 39 with A
        return steps

    def whiten(self, steps: Array) -> Array:
        """A⁻¹ y of steps y (…, n)."""
        scaled = steps / self._scales  # (…, n)
        along = (scaled @ self._axes.T) * (1 / np.sqrt(1 + self._excess) - 1)  # (…, k)
        scaled += along @ self._axes  # (…, n)
        return scaled

    def distance2(self, steps: Array) -> Array:
        """yᵀ C⁻¹ y (P,) of steps y (P, n)."""
        scaled = steps / self._scales  # (P, n)
        along = np.square(scaled @ self._axes.T)  # (P, k)
        squares: Array = np.square(scaled).sum(axis=1) - along @ (self._excess / (1 + self._excess))  # (P,)
        return squares

    def update(self, keep: float, c_1: float, path: Array, weights: Array, steps: Array) -> None:
        """Eq. 47, projected to rank k by Akimoto and Hansen 2016, section 3.2.

        Seen from D, eq. 47 without its negative terms is keep + Bᵀ B with few rows B. Its k largest
        eigenvalues λ and their vectors are kept, the mean α of all others stands for those (a = λ / α - 1),
        and D is set so that the diagonal of C is that of eq. 47, negative terms as in `Diagonal.update`.
        The arguments are those of `Diagonal.update`.
        """
        k, n, mu = *self._axes.shape, int(np.count_nonzero(weights > 0))
        scaled = steps / self._scales  # (P, n)
        rows = np.concatenate((self._axes, (path / self._scales)[None], scaled[:mu]))  # (k + 1 + mu, n)
        rows *= np.sqrt(np.concatenate((keep * self._excess, [c_1], weights[:mu])))[:, None]
        grown = keep + np.square(rows).sum(axis=0)  # (n,)
        variance = np.maximum(grown + weights[mu:] @ np.square(scaled[mu:]), 0.5 * grown)  # (n,)
        values, vectors = np.linalg.eigh(rows @ rows.T)  # (k + 1 + mu,)
        values, vectors = values[values.size - k :], vectors[:, values.size - k :]  # the k largest
        largest = keep + values  # (k,) λ
        rest = max((grown.sum() - largest.sum()) / (n - k), keep)  # α
        self._axes = (vectors.T @ rows) / np.sqrt(np.maximum(values, SMALLEST))[:, None]  # (k, n)
        self._excess = np.clip(largest / rest - 1, 0.0, _CONDITION_LIMIT)  # (k,)
        variance /= 1 + self._excess @ np.square(self._axes)  # (n,)
        self._scales = np.maximum(self._scales * np.sqrt(variance), math.sqrt(SMALLEST))  # (n,)


class Full:
    """Full C = B D² Bᵀ; B and D may be `gap` generations old, the more the lower the learning rate (B.2)."""

    def __init__(self, n: int, rate: float) -> None:
        self._matrix, self._basis, self._roots = np.eye(n), np.eye(n), np.ones(n)
        self._age, self._gap = 0, max(1, int(1 / (10 * n * rate)))  # B.2

    def colour(self, normal: Array) -> Array:
        """Steps (…, n) of standard normal samples (…, n)."""
        return (normal * self._roots) @ self._basis.T  # (…, n) eq. 39

    def whiten(self, steps: Array) -> Array:
        """C^-1/2 y of steps y (…, n)."""
        return ((steps @ self._basis) / self._roots) @ self._basis.T  # (…, n)

    def distance2(self, steps: Array) -> Array:
        """yᵀ C⁻¹ y (P,) of steps y (P, n)."""
        squares: Array = np.square((steps @ self._basis) / self._roots).sum(axis=1)  # (P,)
        return squares

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


Shape = Diagonal | LowRank | Full
"""What `CMAES` needs of a covariance: `colour`, `whiten`, `distance2` and `update`."""


def rank(n: int) -> int:
    """Directions k of a low-rank covariance of n variables."""
    return min(RANK, n - 1)


def identity(kind: Covariance, n: int, rate: float) -> Shape:
    """C = 1 for n variables; `rate` = c_1 + c_mu says how often a full one is decomposed (B.2)."""
    if kind == "diagonal":
        return Diagonal(n)
    return LowRank(n) if kind == "low_rank" else Full(n, rate)
