"""Change of variables to the nodes of splines, which matter about alike then (`kinematics.conditioning`).

With the poses x = x₀ + B c of all frames and their banded Hessian A, that of c is Bᵀ A B, which is a band
again: a frame depends on few rows of c, and those of frames that are tied are near. What all frames share is
a border:

    [Bᵀ A B  Bᵀ E; Eᵀ B  S] = M Mᵀ,   M = [L 0; Wᵀ C],   W = L⁻¹ Bᵀ E,   C Cᵀ = S - Wᵀ W
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky_banded, solve_triangular
from scipy.linalg.blas import dtbmv, dtbsv
from scipy.linalg.lapack import dtbtrs

from simrecon.kinematics import layout
from simrecon.kinematics.banded import DAMPING
from simrecon.kinematics.hessian import Curvature
from simrecon.kinematics.layout import FREE, Variables
from simrecon.planners.soft_contact.nodes import ROWS, Nodes
from simrecon.types import Array, IntArray

REACH = ROWS + 2
"""Rows of c, from one on, that a row is tied to: frames are tied to the next two, at most a piece off."""
WIDTH = REACH * FREE


@dataclass(frozen=True, eq=False)
class SplineConditioning:
    """A linear map from well-scaled unknowns u (n,) of the splines to the packed variables of all frames.

    Attributes:
        nodes: of the splines.
        start: x₀ (n',), where u is zero.
        band: (WIDTH, FREE·count) L, by rows below the diagonal.
        border: (FREE·count, m) W. corner: (m, m) C, lower triangular.
    """

    nodes: Nodes
    start: Array
    band: Array
    border: Array
    corner: Array

    @property
    def free(self) -> int:
        """Number of unknowns that are of the nodes; those after them are shared by all frames."""
        return FREE * self.nodes.count

    def to_variables(self, u: Array) -> Array:
        """The packed variables of u (n,): x₀ + B M⁻ᵀ u."""
        own, shared = u[: self.free], u[self.free :]
        shared = solve_triangular(self.corner, shared, lower=True, trans="T", check_finite=False)
        own = dtbsv(WIDTH - 1, self.band, own - self.border @ shared, lower=1, trans=1)
        moved = self.nodes.basis @ own.reshape(-1, FREE)
        return self.start + layout.from_frames(moved, shared)

    def from_variables(self, x: Array) -> Array:
        """The u (n,) whose splines come next to packed variables; zero at the start."""
        own, shared = layout.by_frame(x - self.start, len(self.nodes.first))
        own = self.nodes.nearest(own.reshape(-1, FREE)).ravel()
        product = dtbmv(WIDTH - 1, self.band, own, lower=1, trans=1) + self.border @ shared
        return np.concatenate((product, self.corner.T @ shared))

    def gradient(self, g: Array) -> Array:
        """Gradient with respect to u of one with respect to the packed variables: M⁻¹ Bᵀ g."""
        own, shared = layout.by_frame(g, len(self.nodes.first))
        by_node = np.asarray(self.nodes.basis.T @ own.reshape(-1, FREE)).ravel()
        own = dtbsv(WIDTH - 1, self.band, by_node, lower=1, trans=0)
        rest = shared - self.border.T @ own
        return np.concatenate((own, solve_triangular(self.corner, rest, lower=True, check_finite=False)))


def condition(nodes: Nodes, parts: Iterable[Curvature], start: Variables) -> SplineConditioning:
    """Factor a curvature of all frames as one of the splines that begin with a motion.

    Args:
        nodes: of the splines.
        parts: blocks of frames, one after the other.
        start: where it is taken.
    """
    blocks = np.zeros((REACH, nodes.count, FREE, FREE))
    shared = len(start.pack()) - FREE * len(nodes.first)
    border, corner = np.zeros((nodes.count, FREE * shared)), np.zeros((shared, shared))
    first = 0
    for part in parts:
        stop = first + len(part.border)
        for k, block in enumerate(part.blocks):
            _gather(blocks, nodes, block, first, k)
        rows = slice(nodes.first[first], nodes.first[stop - 1] + ROWS)
        border[rows] += nodes.basis[first:stop, rows].T @ part.wide().reshape(stop - first, -1)
        corner += part.corner
        first = stop
    band = _banded(blocks)
    band[0] *= 1 + DAMPING
    factor = np.asfortranarray(cholesky_banded(band, lower=True, overwrite_ab=True))
    solved, _ = dtbtrs(factor, border.reshape(-1, shared), uplo="L")
    rest = corner - solved.T @ solved + DAMPING * np.diag(np.diag(corner))
    return SplineConditioning(nodes, start.pack(), factor, solved, np.linalg.cholesky(rest))


def _gather(blocks: Array, nodes: Nodes, block: Array, first: int, k: int) -> None:
    """Add what ties frames t + k with t, from `first` on, to blocks (REACH, count, FREE, FREE) by rows of c.

    Args:
        blocks: of row b + d with row b, at [d, b].
        nodes: of the splines.
        block: (n, FREE, FREE) of frame t + k with frame t, as in `Curvature`.
        first: of these frames.
        k: how far apart.
    """
    at = np.arange(first, first + len(block))
    flat = block.reshape(len(block), FREE * FREE) * (1.0 if k else 0.5)  # both triangles are added below
    outer = (nodes.weights[at + k][:, :, None] * nodes.weights[at][:, None]).reshape(len(at), ROWS**2)
    for late, early, rows in _runs(nodes, at, k):
        tied = (outer[rows].T @ flat[rows]).reshape(ROWS, ROWS, FREE, FREE)
        for i in range(ROWS):
            for j in range(ROWS):
                a, b = late + i, early + j
                if a >= b:
                    blocks[a - b, b] += tied[i, j]
                if b >= a:
                    blocks[b - a, a] += tied[i, j].T


def _runs(nodes: Nodes, at: IntArray, k: int) -> Iterator[tuple[int, int, slice]]:
    """Runs of frames between the same nodes, as those k frames later are: first rows of both, and which."""
    if not len(at):
        return
    late, early = nodes.first[at + k], nodes.first[at]
    cuts = np.flatnonzero(np.diff(late) | np.diff(early)) + 1
    for start, stop in zip([0, *cuts], [*cuts, len(at)], strict=True):
        yield int(late[start]), int(early[start]), slice(start, stop)


def _banded(blocks: Array) -> Array:
    """A symmetric matrix of blocks (REACH, count, FREE, FREE) by its diagonals, (WIDTH, FREE·count)."""
    count = blocks.shape[1]
    columns = np.moveaxis(blocks, 0, 1).transpose(0, 3, 1, 2).reshape(count, FREE, WIDTH)
    band = np.zeros((count, FREE, WIDTH))
    for column in range(FREE):
        band[:, column, : WIDTH - column] = columns[:, column, column:]
    return np.asfortranarray(band.reshape(-1, WIDTH).T)
