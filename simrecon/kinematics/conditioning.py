"""Change of variables after which all unknowns of the kinematic fit matter about alike, as L-BFGS wants it.

The Hessian of the objective, as Gauss and Newton approximate it, is banded over time: second differences tie
a frame to two on either side. What all frames share (scale, lengths, lean) makes a border of a few columns:

    H = [A B; Bᵀ S] = M Mᵀ,   M = [L 0; Wᵀ C],   A = L Lᵀ,  W = L⁻¹ B,  C Cᵀ = S - Wᵀ W

The search runs in u = Mᵀ x, in which the Hessian is near to the identity. Cost is linear in the frames.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky_banded, solve_triangular
from scipy.linalg.lapack import dtbtrs

from simrecon.kinematics.curvature import FREE, REACH, Curvature
from simrecon.types import Array

DAMPING = 1e-6
"""Share of the diagonal that is added, so that the factor exists."""


@dataclass(frozen=True, eq=False)
class Conditioning:
    """A linear map between the packed variables x (n,) and well-scaled ones u (n,).

    Attributes:
        band: (162, 54 T) lower band of L, frame by frame.
        border: (54 T, m) W.
        corner: (m, m) C, lower triangular.
    """

    band: Array
    border: Array
    corner: Array

    def to_variables(self, u: Array) -> Array:
        """The packed variables x (n,) of u (n,): M⁻ᵀ u."""
        own, shared = self._split(u)
        shared = solve_triangular(self.corner, shared, lower=True, trans="T", check_finite=False)
        return _packed(self._solve(own - self.border @ shared, "T"), shared)

    def from_variables(self, x: Array) -> Array:
        """The scaled variables u (n,) of x (n,): Mᵀ x."""
        own, shared = by_frame(x, len(self.border))
        product = self.band[0] * own
        for offset in range(1, len(self.band)):
            product[:-offset] += self.band[offset, :-offset] * own[offset:]
        return np.concatenate((product + self.border @ shared, self.corner.T @ shared))

    def gradient(self, g: Array) -> Array:
        """Gradient with respect to u of one with respect to x: M⁻¹ g."""
        own, shared = by_frame(g, len(self.border))
        own = self._solve(own, "N")
        rest = shared - self.border.T @ own
        return np.concatenate(
            (own, solve_triangular(self.corner, rest, lower=True, trans="N", check_finite=False))
        )

    def _solve(self, right: Array, transposed: str) -> Array:
        solved, _ = dtbtrs(self.band, right[:, None], uplo="L", trans=transposed)
        return np.asarray(solved[:, 0])

    def _split(self, u: Array) -> tuple[Array, Array]:
        return u[: len(self.border)], u[len(self.border) :]


def condition(curvature: Curvature) -> Conditioning:
    """Factor a curvature."""
    frames = len(curvature.blocks[0])
    band = np.zeros((FREE * (REACH + 1), frames, FREE))
    rows, columns = np.indices((FREE, FREE))
    for offset, block in enumerate(curvature.blocks):
        below = rows >= columns if offset == 0 else np.ones_like(rows, bool)
        row, column = rows[below], columns[below]
        band[FREE * offset + row - column, : frames - offset, column] = block[:, row, column].T
    band[0] *= 1 + DAMPING
    factor = cholesky_banded(band.reshape(len(band), -1), overwrite_ab=True, lower=True, check_finite=False)
    border, _ = dtbtrs(factor, curvature.border.reshape(-1, len(curvature.corner)), uplo="L", trans="N")
    corner = curvature.corner - border.T @ border
    corner[np.diag_indices_from(corner)] += DAMPING * np.diag(curvature.corner)
    return Conditioning(factor, border, np.linalg.cholesky(corner))


def by_frame(x: Array, count: int) -> tuple[Array, Array]:
    """Packed variables as those of one frame after the other (54 T,), and the shared ones."""
    frames = count // FREE
    root, turns = x[: 3 * frames].reshape(frames, 3), x[3 * frames : count].reshape(17, frames, 3)
    own = np.concatenate((root, np.swapaxes(turns, 0, 1).reshape(frames, -1)), axis=1)  # (T, 54)
    return own.ravel(), x[count:]


def _packed(own: Array, shared: Array) -> Array:
    """The inverse of `by_frame`."""
    by_time = own.reshape(-1, FREE)
    turns = np.swapaxes(by_time[:, 3:].reshape(len(by_time), 17, 3), 0, 1)
    return np.concatenate((by_time[:, :3].ravel(), turns.ravel(), shared))
