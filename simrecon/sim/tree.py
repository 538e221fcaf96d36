"""Which degree of freedom carries which: bodies and joints of a model as masks."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from simrecon.types import Array, IntArray

BALL, FREE = int(mujoco.mjtJoint.mjJNT_BALL), int(mujoco.mjtJoint.mjJNT_FREE)
SLIDE = int(mujoco.mjtJoint.mjJNT_SLIDE)
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Tree:
    """Masks over the degrees of freedom (V) and bodies (B) of a model.

    Attributes:
        carries: (B, V) whether a degree of freedom carries a body.
        above: (V, V) [j, k]: j's body is k's or carries it, by depth; same body included.
        moves: (V, V) [j, k]: the axis of j is moved by k.
        before: (V, V) [j, k]: j acts before k's joint; of a free joint, shifts act before turns.
        after: (V, V) [j, k]: the same with k's own part.
        moved: (B,) whether anything carries a body.
        root: (B,) first degree of freedom of the free joint that carries a body's tree, or -1.
        roots: (B, V) those six; rooted: (V,) whether one is of those.
        turns: (R, 3) degrees of freedom of rotations of ball and free joints; quaternions: (R,) first `qpos`.
    """

    carries: Mask
    above: Mask
    moves: Mask
    before: Mask
    after: Mask
    moved: Mask
    root: IntArray
    roots: Mask
    rooted: Mask
    turns: IntArray
    quaternions: IntArray

    @classmethod
    def of(cls, model: mujoco.MjModel) -> Tree:
        """Of a model."""
        nv, body = model.nv, np.asarray(model.dof_bodyid, np.int64)
        carries = np.zeros((model.nbody, nv), bool)
        for own in range(1, int(model.nbody)):
            carries[own] = carries[model.body_parentid[own]] | (body == own)
        joint, kind = model.dof_jntid, model.jnt_type[model.dof_jntid]
        index = np.arange(nv)
        turning = (kind == FREE) & (index >= model.jnt_dofadr[joint] + 3)
        part = 2 * joint + turning  # parts of joints that act at once, in their order
        above = carries[body].T  # [j, k]
        before = above & (part[:, None] < part[None, :])
        same = part[:, None] == part[None, :]
        moves = before.T | (same & (turning | (kind == BALL))[:, None])
        root = np.full(model.nbody, -1)
        for own in np.flatnonzero(carries.any(axis=1)).tolist():
            first = int(np.argmax(carries[own]))
            root[own] = first if kind[first] == FREE else -1
        roots = (root[:, None] >= 0) & (index >= root[:, None]) & (index < root[:, None] + 6)
        turns, quaternions = _turns(model)
        moved, rooted = np.asarray(carries.any(axis=1)), np.asarray(roots.any(axis=0))
        return cls(
            carries, above, moves, before, before | same, moved, root, roots, rooted, turns, quaternions
        )

    def blocks(self, diagonal: Array, turns: Array) -> Array:
        """Matrices (N, V, V) with a diagonal (N, V), and for each rotation a block, of (N, R, 3, 3)."""
        matrix, every = np.zeros((*diagonal.shape, diagonal.shape[1])), np.arange(diagonal.shape[1])
        matrix[:, every, every] = diagonal
        matrix[:, self.turns[:, :, None], self.turns[:, None, :]] = turns
        return matrix


def _turns(model: mujoco.MjModel) -> tuple[IntArray, IntArray]:
    """Degrees of freedom (R, 3) and first `qpos` (R,) of the rotations of ball and free joints."""
    free, ball = model.jnt_type == FREE, model.jnt_type == BALL
    starts = np.concatenate((model.jnt_dofadr[free] + 3, model.jnt_dofadr[ball]))
    places = np.concatenate((model.jnt_qposadr[free] + 3, model.jnt_qposadr[ball]))
    order = np.argsort(starts)
    return starts[order].astype(np.int64)[:, None] + np.arange(3), places[order].astype(np.int64)
