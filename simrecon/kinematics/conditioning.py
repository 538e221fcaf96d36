"""Change of variables after which all unknowns of the kinematic fit matter about alike, as L-BFGS wants it.

The Hessian of the objective, as Gauss and Newton approximate it, is banded over time: second differences tie
a frame to two on either side. What all frames share (scale, lengths, lean) makes a border of a few columns:

    H = [A B; Bᵀ S] = M Mᵀ,   M = [L 0; Wᵀ C],   A = L Lᵀ,  W = L⁻¹ B,  C Cᵀ = S - Wᵀ W

The search runs in u = Mᵀ x, in which the Hessian is near to the identity. Cost is linear in the frames.

Any invertible M is right, so L and B are kept with half the digits: what that changes in M Mᵀ is less than
the damping. They are applied with all digits, L some frames at a time. To widen its numbers takes longer than
a solve, so that is done once for all for the first `WIDE` blocks. W would be as large as L, so it is not
kept: L⁻¹ B costs another solve. That makes 38 KiB per frame, of which L is 34, and 34 more for the first
thousand.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.linalg.blas import dtbmv, dtbsv
from scipy.linalg.lapack import dtbtrs

from simrecon.kinematics import layout
from simrecon.kinematics.banded import DAMPING, IDENTITY, TAIL, WIDTH, carried_by, factored
from simrecon.kinematics.hessian import Curvature
from simrecon.kinematics.layout import FREE, LEAN
from simrecon.types import Array

SOME = 2000
"""Frames whose border is multiplied at once."""
WIDE = 16
"""Blocks of L, of 64 frames each, that are kept ready to be applied."""


@dataclass(frozen=True, eq=False)
class Conditioning:
    """A linear map between the packed variables x (n,) and well-scaled ones u (n,).

    Attributes:
        columns: of L from the diagonal down, (FREE n + TAIL, WIDTH) of each block of n frames, and of the
            identity for the unknowns after it.
        border: (T, FREE, 2 + L + 3) and leans: (T, F): B, as in `Curvature`.
        corner: (m, m) C, lower triangular.
    """

    columns: tuple[NDArray[np.floating], ...]
    border: NDArray[np.float32]
    leans: Array
    corner: Array

    @property
    def free(self) -> int:
        """Number of unknowns that are of one frame, FREE·T; those after them are shared by all."""
        return FREE * len(self.border)

    def to_variables(self, u: Array) -> Array:
        """The packed variables x (n,) of u (n,): M⁻ᵀ u."""
        own, shared = u[: self.free], u[self.free :]
        shared = solve_triangular(self.corner, shared, lower=True, trans="T", check_finite=False)
        own = self._solved(own - self._solved(self._spread(shared)), transposed=True)
        return layout.from_frames(own, shared)

    def from_variables(self, x: Array) -> Array:
        """The scaled variables u (n,) of x (n,): Mᵀ x."""
        own, shared = layout.by_frame(x, len(self.border))
        product = np.append(own, np.zeros(TAIL))
        for place, band in self._bands():
            product[place] = dtbmv(WIDTH - 1, band, product[place], lower=1, trans=1)
        own = product[: self.free] + self._solved(self._spread(shared))
        return np.concatenate((own, self.corner.T @ shared))

    def gradient(self, g: Array) -> Array:
        """Gradient with respect to u of one with respect to x: M⁻¹ g."""
        own, shared = layout.by_frame(g, len(self.border))
        own = self._solved(own)
        rest = shared - self._gathered(self._solved(own, transposed=True))
        shared = solve_triangular(self.corner, rest, lower=True, check_finite=False)
        return np.concatenate((own, shared))

    def _solved(self, right: Array, *, transposed: bool = False) -> Array:
        """L⁻¹ right or L⁻ᵀ right, (FREE·T,).

        Forwards, a block leaves in the unknowns after it what the next has to begin with; backwards it finds
        there what is known of them.
        """
        x = np.append(right, np.zeros(TAIL))
        for place, band in self._bands(backwards=transposed):
            x[place] = dtbsv(WIDTH - 1, band, x[place], lower=1, trans=int(transposed))
        return x[: self.free]

    def _bands(self, *, backwards: bool = False) -> Iterator[tuple[slice, Array]]:
        """By block, where it is with the unknowns after it, and L (WIDTH, …), there as if the identity."""
        starts = np.cumsum([0, *(len(band) - TAIL for band in self.columns)])
        order = range(len(self.columns))
        for i in reversed(order) if backwards else order:
            band = self.columns[i].astype(np.float64, copy=False)
            yield slice(starts[i], starts[i] + len(band)), band.T

    def _spread(self, shared: Array) -> Array:
        """B shared, (FREE·T,)."""
        plain = self.border.shape[-1] - LEAN
        lean = self.leans @ shared[plain:].reshape(-1, LEAN)  # (T, 3)
        of_frame = np.concatenate((np.broadcast_to(shared[:plain], (len(lean), plain)), lean), axis=1)
        parts = [self.border[rows] @ of_frame[rows, :, None] for rows in self._some()]
        return np.concatenate(parts).ravel()

    def _some(self) -> Iterator[slice]:
        """Frames, some at a time, for a product turns what it takes of the border into double precision."""
        return (slice(start, start + SOME) for start in range(0, len(self.border), SOME))

    def _gathered(self, own: Array) -> Array:
        """Bᵀ own, (m,)."""
        by_time = own.reshape(-1, 1, FREE)
        parts = [by_time[rows] @ self.border[rows] for rows in self._some()]
        of_frame = np.concatenate(parts)[:, 0]  # (T, 2 + L + 3)
        plain, lean = of_frame[:, :-LEAN], of_frame[:, -LEAN:]
        return np.concatenate((plain.sum(axis=0), (self.leans.T @ lean).ravel()))


def _kept(band: Array, *, wide: bool) -> NDArray[np.floating]:
    """A block with half its digits, in so many bytes or in twice as many."""
    half = band.astype(np.float32)
    return half.astype(np.float64) if wide else half


def condition(parts: Iterable[Curvature]) -> Conditioning:
    """Factor a curvature.

    Args:
        parts: its blocks of frames, one after the other; of each only half the digits are kept.
    """
    columns: list[NDArray[np.floating]] = []
    borders, leans = [], []
    corner = squared = np.zeros(())  # S and Wᵀ W so far
    # what the frames before take from the first unknowns of a block: of A, and of B
    carried, left = np.zeros((TAIL, TAIL)), np.zeros(())
    for part in parts:
        band = factored(part, carried)
        count = len(band) - TAIL
        carried = carried_by(band)
        band[count:] = IDENTITY
        columns.append(_kept(band, wide=len(columns) < WIDE))
        wide = part.wide().reshape(count, -1)
        right = np.concatenate((wide, np.zeros((TAIL, wide.shape[1]))))
        right[:TAIL] += left
        solved, _ = dtbtrs(band.T, right, uplo="L")
        left = solved[count:]
        corner, squared = corner + part.corner, squared + solved[:count].T @ solved[:count]
        borders.append(part.border.astype(np.float32))
        leans.append(part.leans)
    rest = np.asarray(corner - squared + DAMPING * np.diag(np.diag(corner)))
    lower: Array = np.asarray(np.linalg.cholesky(rest), dtype=np.float64)
    return Conditioning(tuple(columns), np.concatenate(borders), np.concatenate(leans), lower)
