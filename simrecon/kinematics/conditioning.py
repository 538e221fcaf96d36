"""Change of variables after which all unknowns of the kinematic fit matter about alike, as L-BFGS wants it.

The Hessian of the objective, as Gauss and Newton approximate it, is banded over time: second differences tie
a frame to two on either side. What all frames share (scale, lengths, lean) makes a border of a few columns:

    H = [A B; Bᵀ S] = M Mᵀ,   M = [L 0; Wᵀ C],   A = L Lᵀ,  W = L⁻¹ B,  C Cᵀ = S - Wᵀ W

The search runs in u = Mᵀ x, in which the Hessian is near to the identity. Cost is linear in the frames.

Any invertible M is right, so L and B are kept with half the digits: what that changes in M Mᵀ is less than
the damping. They are applied with all digits, L some frames at a time. W would be as large as L, so it is not
kept: L⁻¹ B costs another solve. That makes 38 KiB per frame, of which L is 34.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.linalg.blas import dtbmv, dtbsv
from scipy.linalg.lapack import dpbtrf, dtbtrs

from simrecon.kinematics.curvature import FREE, LEAN, REACH, Curvature
from simrecon.types import Array, IntArray

DAMPING = 1e-6
"""Share of the diagonal that is added, so that the factor exists."""
WIDTH = FREE * (REACH + 1)
TAIL = FREE * REACH
"""Unknowns beyond a block of frames that it is tied to."""
SOME = 2000
"""Frames whose border is multiplied at once."""
STIFF = 1e100
"""What is added to the diagonal of frames to come, while the factor of those before them is made."""


@dataclass(frozen=True, eq=False)
class Conditioning:
    """A linear map between the packed variables x (n,) and well-scaled ones u (n,).

    Attributes:
        columns: of L from the diagonal down, (54 n, 162) of each block of n frames.
        border: (T, 54, 2 + L + 3) and leans: (T, F): B, as in `Curvature`.
        corner: (m, m) C, lower triangular.
    """

    columns: tuple[NDArray[np.float32], ...]
    border: NDArray[np.float32]
    leans: Array
    corner: Array

    @property
    def free(self) -> int:
        """Number of unknowns that are of one frame, 54 T; those after them are shared by all."""
        return FREE * len(self.border)

    def to_variables(self, u: Array) -> Array:
        """The packed variables x (n,) of u (n,): M⁻ᵀ u."""
        own, shared = u[: self.free], u[self.free :]
        shared = solve_triangular(self.corner, shared, lower=True, trans="T", check_finite=False)
        return _packed(self._solved(own - self._solved(self._spread(shared)), transposed=True), shared)

    def from_variables(self, x: Array) -> Array:
        """The scaled variables u (n,) of x (n,): Mᵀ x."""
        own, shared = by_frame(x, self.free)
        product = np.append(own, np.zeros(TAIL))
        for place, band in self._bands():
            product[place] = dtbmv(WIDTH - 1, band, product[place], lower=1, trans=1)
        own = product[: self.free] + self._solved(self._spread(shared))
        return np.concatenate((own, self.corner.T @ shared))

    def gradient(self, g: Array) -> Array:
        """Gradient with respect to u of one with respect to x: M⁻¹ g."""
        own, shared = by_frame(g, self.free)
        own = self._solved(own)
        rest = shared - self._gathered(self._solved(own, transposed=True))
        shared = solve_triangular(self.corner, rest, lower=True, check_finite=False)
        return np.concatenate((own, shared))

    def _solved(self, right: Array, *, transposed: bool = False) -> Array:
        """L⁻¹ right or L⁻ᵀ right, (54 T,).

        Forwards, a block leaves in the unknowns after it what the next has to begin with; backwards it finds
        there what is known of them.
        """
        x = np.append(right, np.zeros(TAIL))
        for place, band in self._bands(backwards=transposed):
            x[place] = dtbsv(WIDTH - 1, band, x[place], lower=1, trans=int(transposed))
        return x[: self.free]

    def _bands(self, *, backwards: bool = False) -> Iterator[tuple[slice, Array]]:
        """By block, where it is with the unknowns after it, and L (162, …), there as if the identity."""
        work = np.empty((len(self.columns[0]) + TAIL, WIDTH))
        starts = np.cumsum([0, *map(len, self.columns)])
        order = range(len(self.columns))
        for i in reversed(order) if backwards else order:
            count = len(self.columns[i])
            work[:count] = self.columns[i]
            work[count : count + TAIL] = _IDENTITY
            yield slice(starts[i], starts[i + 1] + TAIL), work[: count + TAIL].T

    def _spread(self, shared: Array) -> Array:
        """B shared, (54 T,)."""
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


_IDENTITY = np.eye(1, WIDTH)
_ROWS, _COLUMNS = np.indices((FREE, FREE))
_LOWER = _ROWS >= _COLUMNS


def _within(k: int) -> tuple[IntArray, IntArray, IntArray]:
    """Rows and columns of the block of frame t + k with t, and where they are in (54 · 162) of the band."""
    there = _LOWER if k == 0 else np.ones_like(_LOWER)
    place = _COLUMNS * WIDTH + FREE * k + _ROWS - _COLUMNS
    return _ROWS[there], _COLUMNS[there], place[there]


_PLACES = tuple(_within(k) for k in range(REACH + 1))


def condition(parts: Iterable[Curvature]) -> Conditioning:
    """Factor a curvature, one block of frames after the other."""
    columns, borders, leans = [], [], []
    corner = squared = np.zeros(())  # S and Wᵀ W so far
    # what the frames before take from the first unknowns of a block: of A, and of B
    taken, left = np.zeros((TAIL, TAIL)), np.zeros(())
    for part in parts:
        band = _factored(part, taken)
        count = len(band) - TAIL
        columns.append(band[:count].astype(np.float32))
        taken = _taken(band)
        band[count:] = _IDENTITY
        wide = part.wide().reshape(count, -1)
        right = np.concatenate((wide, np.zeros((TAIL, wide.shape[1]))))
        right[:TAIL] += left
        solved, _ = dtbtrs(band.T, right, uplo="L")
        left = solved[count:]
        corner, squared = corner + part.corner, squared + solved[:count].T @ solved[:count]
        borders.append(part.border.astype(np.float32))  # of all that was made of the block
        leans.append(part.leans)
    rest = np.asarray(corner - squared + DAMPING * np.diag(np.diag(corner)))
    lower: Array = np.asarray(np.linalg.cholesky(rest), dtype=np.float64)
    return Conditioning(tuple(columns), np.concatenate(borders), np.concatenate(leans), lower)


def _factored(part: Curvature, taken: Array) -> Array:
    """Columns (54 (n + 2), 162) of L of a block of n frames, and stiff ones after it."""
    frames = len(part.border)
    band = np.zeros((frames + REACH, FREE, WIDTH))
    flat = band.reshape(frames + REACH, -1)
    for block, (row, column, place) in zip(part.blocks, _PLACES, strict=True):
        flat[: len(block), place] = block[:, row, column]
    band[:frames, :, 0] *= 1 + DAMPING
    band[frames:, :, 0] = STIFF
    for frame, k in ((0, 0), (0, 1), (1, 0)):
        row, column, place = _PLACES[k]
        flat[frame, place] -= taken[FREE * (frame + k) + row, FREE * frame + column]
    factor, failed = dpbtrf(band.reshape(-1, WIDTH).T, lower=1, overwrite_ab=1)
    if failed:
        raise np.linalg.LinAlgError(f"the curvature is not positive at unknown {failed} of a block")
    return np.asarray(factor.T)


def _taken(band: Array) -> Array:
    """E Eᵀ (108, 108) of the rows E of L that reach from a block's last frames to those after it."""
    reach = np.zeros((REACH, FREE, REACH, FREE))
    flat = band.reshape(-1, FREE * WIDTH)
    if len(flat) < 2 * REACH:  # the clip's last frame, alone
        return reach.reshape(TAIL, TAIL)
    last = flat[-2 * REACH : -REACH]
    for after, frame, k in ((0, 0, 2), (0, 1, 1), (1, 1, 2)):
        row, column, place = _PLACES[k]
        reach[after, row, frame, column] = last[frame, place]
    square = reach.reshape(TAIL, TAIL)
    return square @ square.T


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
