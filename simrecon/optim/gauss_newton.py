"""Gauss-Newton on sums of robust terms: weights, damped steps, and a covariance for sampling.

A loss Σ_k w_k ρ(‖r_k‖) of vectors r_k(x) is replaced, near x₀, by the sum of squares Σ_k ω_k ‖r_k‖² with
ω_k = w_k ρ'(‖r_k‖) / (2 ‖r_k‖) taken at x₀, which has the same gradient there (iteratively reweighted least
squares; Holland & Welsch 1977). With the Jacobian J of the weighted vectors, its Hessian is 2 J Jᵀ.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import linalg

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


class Quadratic:
    """The sum of squares near a point: damped steps from there, and a covariance for samples around it."""

    def __init__(self, curvature: Array, gradient: Array) -> None:
        """Take J Jᵀ (n, n) and J r (n,), for a Jacobian J (n, R) of r (R,)."""
        self._curvature, self._gradient = curvature, gradient

    def step(self, damping: float) -> Array:
        """Levenberg-Marquardt step -(J Jᵀ + λ)⁻¹ J r (n,) for a damping λ.

        Zero if J Jᵀ + λ is not positive, as it may be to rounding.
        """
        damped = self._curvature + max(damping, DAMPING_MIN) * np.eye(len(self._gradient))
        try:
            factor = linalg.cho_factor(damped, overwrite_a=True, check_finite=False)
        except np.linalg.LinAlgError:
            return np.zeros_like(self._gradient)
        step: Array = -linalg.cho_solve(factor, self._gradient, check_finite=False)
        return step

    def root_covariance(self, rise: float, sigma: float) -> Array:
        """Symmetric root (n, n) of C = (2 J Jᵀ n / (2 rise) + 1 / sigma²)⁻¹.

        Samples from C raise the sum of squares by `rise` in the mean where that is what limits them, and are
        no further off than `sigma` in any direction. `rise` is positive.
        """
        values, vectors = np.linalg.eigh(self._curvature)
        precision = np.maximum(values, 0.0) * (len(values) / rise) + 1.0 / sigma**2
        root: Array = (vectors / np.sqrt(precision)) @ vectors.T
        return root
