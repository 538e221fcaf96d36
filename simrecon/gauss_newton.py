"""Gauss-Newton on sums of robust terms: weights, damped steps, and a covariance for sampling.

A loss Σ_k w_k ρ(‖r_k‖) of vectors r_k(x) is replaced, near x₀, by the sum of squares Σ_k ω_k ‖r_k‖² with
ω_k = w_k ρ'(‖r_k‖) / (2 ‖r_k‖) taken at x₀, which has the same gradient there (iteratively reweighted least
squares; Holland & Welsch 1977). With the Jacobian J of the weighted vectors, its Hessian is 2 J Jᵀ.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from simrecon.types import Array

DAMPING_MIN = 1e-12


@dataclass(frozen=True, eq=False)
class Term:
    """One term of a loss, at P points of the search space.

    Attributes:
        vectors: (P, F, ..., d) whose lengths are penalised.
        slope: ρ', a function of the lengths; None: ρ(s) = s².
        floor: lengths below it count as it, for ω is infinite at zero.
        weight: w, a number or an array that goes with (F, ...), of one per vector.
    """

    vectors: Array
    weight: float | Array
    slope: Callable[[Array], Array] | None = None
    floor: float = 1.0

    def roots(self) -> Array:
        """√ω (F, ..., 1) at the first of the P points."""
        at = self.vectors[0]
        if self.slope is None:
            scale = np.broadcast_to(np.asarray(self.weight, float), at.shape[:-1])
        else:
            length = np.linalg.norm(at, axis=-1)
            scale = self.weight * self.slope(length) / (2.0 * np.maximum(length, self.floor))
        roots: Array = np.sqrt(scale)[..., None]
        return roots


def residuals(terms: list[Term], roots: list[Array]) -> Array:
    """All vectors times their √ω, by the frame at which they are known: (P, F, K).

    F is the most frames that a term has. The vectors of a term with fewer, such as velocities, are those of
    the last frames; before them are zeros.
    """
    count, frames = len(terms[0].vectors), max(term.vectors.shape[1] for term in terms)
    widths = [int(np.prod(term.vectors.shape[2:])) for term in terms]
    found, end = np.zeros((count, frames, sum(widths))), 0
    for term, root, width in zip(terms, roots, widths, strict=True):
        weighted = (root * term.vectors).reshape(count, -1, width)
        found[:, frames - weighted.shape[1] :, end : end + width] = weighted
        end += width
    return found


class Quadratic:
    """The sum of squares near a point; its eigenvectors serve all dampings and the sampling covariance."""

    def __init__(self, curvature: Array, gradient: Array) -> None:
        """Take J Jᵀ = V diag(w) Vᵀ (n, n) apart; gradient is J r (n,), for a Jacobian J (n, R) of r (R,)."""
        values, self._vectors = np.linalg.eigh(curvature)
        self._values: Array = np.maximum(values, 0.0)
        self._gradient = self._vectors.T @ gradient

    def steps(self, dampings: Array) -> Array:
        """Levenberg-Marquardt steps -(J Jᵀ + λ)⁻¹ J r, (L, n) for dampings λ (L,)."""
        scaled = self._gradient / (self._values + np.maximum(dampings, DAMPING_MIN)[:, None])  # (L, n)
        found: Array = -scaled @ self._vectors.T
        return found

    def root_covariance(self, rise: float, sigma: float) -> Array:
        """Symmetric root (n, n) of C = (2 J Jᵀ n / (2 rise) + 1 / sigma²)⁻¹.

        Samples from C raise the sum of squares by `rise` in the mean where that is what limits them, and are
        no further off than `sigma` in any direction. `rise` is positive.
        """
        precision = self._values * (len(self._values) / rise) + 1.0 / sigma**2
        root: Array = (self._vectors / np.sqrt(precision)) @ self._vectors.T
        return root
