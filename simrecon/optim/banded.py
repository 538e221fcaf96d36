"""Normal equations of residuals that are differences of functions of single frames.

With residuals r_f = √ω_f Σ_k c_k g(q_{f-k}), c the coefficients of an n-th difference, and G_f = ∂g/∂q_f,

    J Jᵀ = Yᵀ W Y,    W[f - k, f - l] += c_k c_l G_{f-k}ᵀ ω_f G_{f-l},
    J r = Σ_f Y_fᵀ b_f,    b_{f-k} += c_k G_{f-k}ᵀ ω_f (√ω⁻¹ r)_f,

where Y stacks the derivatives of the q_f with respect to the unknowns. J itself is never formed. Axes: F
frames, K rows of a frame, V coordinates, X unknowns.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from simrecon.types import Array

Single = NDArray[np.float32]


class Banded:
    """W, by its blocks on and below the diagonal, and b, summed up term by term."""

    def __init__(self, frames: int, coordinates: int, differences: int) -> None:
        """Zero, with room for terms of up to so many differences."""
        self.blocks = np.zeros((differences + 1, frames, coordinates, coordinates), np.float32)
        self.gradient = np.zeros((frames, coordinates))

    def add(self, slope: Array, vectors: Array, weights: Array) -> None:
        """Add a term.

        Args:
            slope: (F, K, V) G.
            vectors: (F - n, K) r / √ω, the n-th differences.
            weights: (F - n, K) ω.
        """
        count, order = len(vectors), len(slope) - len(vectors)
        coefficients = [(-1) ** k * math.comb(order, k) for k in range(order + 1)]  # of frames f - k
        single = slope.astype(np.float32)
        weighted = (vectors * weights)[:, None]  # (F', 1, K)
        for k, c_k in enumerate(coefficients):
            own = slice(order - k, order - k + count)
            self.gradient[own] += c_k * (weighted @ slope[own])[:, 0]
            left = (single[own] * weights[..., None].astype(np.float32)).swapaxes(1, 2)  # (F', V, K)
            for at, c_l in enumerate(coefficients[k:], start=k):
                other = slice(order - at, order - at + count)
                self.blocks[at - k, own] += np.float32(c_k * c_l) * (left @ single[other])

    def squares(self, moves: Single) -> tuple[Array, Array]:
        """J Jᵀ (X, X) and J r (X,) for Y (F, V, X)."""
        frames, size, unknowns = moves.shape
        applied = self.blocks[0] @ moves
        for band in range(1, min(len(self.blocks), frames)):
            block = self.blocks[band, band:]  # (F - band, V, V) of frames f and f - band
            applied[band:] += block @ moves[:-band]
            applied[:-band] += block.swapaxes(1, 2) @ moves[band:]
        flat = moves.reshape(frames * size, unknowns)
        curvature = flat.T @ applied.reshape(frames * size, unknowns)
        gradient = self.gradient.ravel().astype(np.float32) @ flat
        return curvature.astype(np.float64), gradient.astype(np.float64)
