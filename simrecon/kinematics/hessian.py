"""Hessian of a sum of terms, each of which adds its curvature by the quantities of a state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon.kinematics import bands, layout
from simrecon.kinematics.bands import Bands
from simrecon.kinematics.jacobian import Jacobian
from simrecon.kinematics.layout import FREE, JOINT_TURNS, LEAN, ROOT
from simrecon.kinematics.state import State
from simrecon.types import Array

LEAST_PRIOR = 2e-4  # twists that nothing sees must have some unit where a plan has no prior
LEAST_ROOT = 1e-3  # so must the root


@dataclass(frozen=True, eq=False)
class Curvature:
    """Blocks of the Hessian: the n columns of consecutive frames, and their share of the corner.

    Attributes:
        blocks: of frame t + k with frame t, (n, FREE, FREE), for k = 0, 1, 2; fewer where the clip ends.
        border: (n, FREE, 2 + L + 3) of a frame with scale, sole, lengths, and the lean of the frame.
        leans: (n, F) the lean of a frame by its coefficients.
        corner: (m, m) of the m = 2 + L + 3 F shared unknowns.
    """

    blocks: tuple[Array, Array, Array]
    border: Array
    leans: Array
    corner: Array

    def wide(self) -> Array:
        """The border by all shared unknowns, (n, FREE, m)."""
        return _widened(self.border, self.leans)


class Hessian:
    """Sum of the curvatures of terms by the quantities of a state.

    Attributes:
        jacobian: of the state's points.
        frames: (T, n, n) by the n = FREE + 2 + L + 3 unknowns of a frame, those that all share, and its lean.
        plain: view of `frames` without the lean.
        landmarks, feet: bands that tie each of these points over time.
        com: axes of the centre of mass, and bands that tie them.
        nearest: (G, T) half the second derivative by the least clearance of a sphere.
        joints: (T, JOINTS, 3) second derivatives by the joints' rotation vectors.
        rotvecs: bands that tie these vectors.
        prior: weight of the prior on poses.
        shared: (m, m) by what all frames share.
    """

    def __init__(self, state: State) -> None:
        self.state, self.jacobian = state, Jacobian(state)
        frames, lengths = state.problem.frames, len(state.variables.lengths)
        count = FREE + layout.LENGTHS + lengths + LEAN
        self.frames = np.zeros((frames, count, count))
        self.plain = self.frames[:, :-LEAN, :-LEAN]
        self.landmarks: list[Bands] = []
        self.feet: list[Bands] = []
        self.com: list[tuple[slice, Bands]] = []
        self.nearest = np.zeros(state.spheres_m.shape[:2])
        self.joints = np.zeros((frames, layout.JOINTS, layout.AXES))
        self.rotvecs = bands.none(frames)
        self.prior = LEAST_PRIOR
        shared = layout.LENGTHS + lengths + state.variables.lean.size
        self.shared = np.zeros((shared, shared))

    def tie_rotvecs(self, chain: Bands) -> None:
        """Tie the joints' rotation vectors by more bands."""
        self.rotvecs = [band + more for band, more in zip(self.rotvecs, chain, strict=True)]

    def by_variables(self, own: slice) -> Curvature:
        """By the variables, the columns of the `own` frames."""
        frames, jacobian = self.state.problem.frames, self.jacobian
        blocks = [
            self.frames[:, :FREE, :FREE].copy(),
            *(np.zeros((frames - k, FREE, FREE)) for k in range(1, bands.REACH + 1)),
        ]
        for chain in self.landmarks:
            _tie(blocks, jacobian.landmarks, chain)
        for chain in self.feet:
            _tie(blocks, jacobian.feet, chain)
        for axes, chain in self.com:
            _tie(blocks, jacobian.com[:, :, axes], chain)
        self._hold_spheres(blocks[0])
        self._bend_joints(blocks)
        border, leans = self.frames[own, :FREE, FREE:], self.state.problem.leans[own]
        rows = np.swapaxes(_widened(self.frames[own, FREE:, FREE:], leans), 1, 2)  # (T, m, 2 + L + 3)
        corner = _widened(rows, leans).sum(axis=0) + self.shared
        return Curvature((blocks[0][own], blocks[1][own], blocks[2][own]), border, leans, corner)

    def _hold_spheres(self, block: Array) -> None:
        """Add what acts along the normal of the nearest support."""
        if not self.nearest.any():
            return
        _, normals = self.state.nearest
        outer = normals[..., :, None] * normals[..., None, :]  # (G, T, 3, 3)
        weights = np.swapaxes(2 * self.state.dt * self.nearest[..., None, None] * outer, 0, 1)
        touching = weights.any(axis=(0, 2, 3))
        block += gram(self.jacobian.spheres[:, touching], weights[:, touching])

    def _bend_joints(self, blocks: list[Array]) -> None:
        """Add what acts on the rotation vectors, which is diagonal in them."""
        see, dt, rows = self.state.problem.observations, self.state.dt, np.arange(FREE)
        root, turns = rows[ROOT], rows[JOINT_TURNS]
        own = self.joints + 2 * self.prior / see.spread**2
        blocks[0][:, root, root] += LEAST_ROOT * dt
        blocks[0][:, turns, turns] += dt * own.reshape(len(own), -1)
        for block, band in zip(blocks, self.rotvecs, strict=True):
            block[:, turns, turns] += band[:, None]


def gram(moves: Array, weights: Array) -> Array:
    """Σ_p J_pᵀ w_p J_p of derivatives (T, P, 3, n) with weights (T, P, 3, 3), (T, n, n)."""
    frames, _, _, n = moves.shape
    weighted = weights @ moves
    return np.asarray(np.swapaxes(moves.reshape(frames, -1, n), 1, 2) @ weighted.reshape(frames, -1, n))


def _tie(blocks: list[Array], moves: Array, chain: Bands) -> None:
    """Add Σ_p c J_p(t+k)ᵀ J_p(t) with the bands c of k to the blocks; moves (T, P, i, FREE)."""
    frames = len(moves)
    flat = moves.reshape(frames, -1, FREE)
    for k, band in enumerate(chain):
        if band.any():
            blocks[k] += band[:, None, None] * (np.swapaxes(flat[k:], 1, 2) @ flat[: frames - k])


def _widened(columns: Array, leans: Array) -> Array:
    """Columns (T, n, 2 + L + 3) of which the last, of a frame's lean, become those of its coefficients."""
    lean = np.einsum("tni,tf->tnfi", columns[..., -LEAN:], leans).reshape(*columns.shape[:2], -1)
    return np.concatenate((columns[..., :-LEAN], lean), axis=-1)
