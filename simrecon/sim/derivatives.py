"""Derivatives of a trajectory with respect to its control, by the implicit function theorem.

Under the `discrete` integrator the acceleration of a step is (v⁺ - v) / h itself, and inverse dynamics invert
the step exactly: f(q, v, a, u) = 0 on a trajectory, with f the forces that inverse dynamics ask for less
those of the motors. So

    ∂a/∂(q, v) = -F_a⁻¹ [F_q  F_v],        ∂a/∂u = -F_a⁻¹ F_u,

with F_x = ∂f/∂x (`inverse`). F_a is the Hessian of the constraint solver's objective, positive definite; no
constraint is solved again. Positions move by q⁺ = q ⊕ h v⁺, so that tangents δ of them go by

    δq⁺ = E δq + h R δv⁺,        E = exp(h ω)ᵀ and R = J_r(h ω) for rotations, 1 for all else.

Axes: N steps, V degrees of freedom of the model, U motors, X unknowns, K bodies that are felt.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from simrecon.geometry import rotations
from simrecon.sim.inverse import Inverse
from simrecon.sim.spatial import cross
from simrecon.sim.state import qvel_of
from simrecon.sim.tree import Tree
from simrecon.types import Array, IntArray

Single = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Transitions:
    """How small changes of the state go from one step to the next; tangents of q above changes of v.

    Attributes:
        state: (N, 2 V, 2 V) by the state before. control: (N, 2 V, U) by the control.
        wrench: (N, 6 K, 2 V + U) of what acts on the bodies that are felt, by both.
    """

    state: Single
    control: Single
    wrench: Single


def transitions(inverse: Inverse, states: Array, ctrl: Array) -> Transitions:
    """Derivatives of consecutive steps; the velocity after a step at which they fail stays as it was.

    Args:
        inverse: of a model with the `discrete` integrator.
        states: (N + 1, nstate) full states of a trajectory.
        ctrl: (N, U) the control that led from each to the next.
    """
    model = inverse.model
    step_s, nv = model.opt.timestep, model.nv
    forces = inverse.slopes(states, ctrl)
    right = np.concatenate((forces.by_position, forces.by_velocity, forces.by_control), axis=2)
    finite = np.isfinite(right).all(axis=(1, 2)) & np.isfinite(forces.by_acceleration).all(axis=(1, 2))
    known = np.asarray(finite)[:, None, None]
    left = np.where(known, forces.by_acceleration, np.eye(nv))
    change = np.linalg.solve(left, np.where(known, -step_s * right, 0.0))  # of v
    felt = forces.wrenches.reshape(len(ctrl), -1, 3 * nv)
    wrench = felt[..., 2 * nv :] @ change / step_s
    wrench[..., : 2 * nv] += felt[..., : 2 * nv]
    change[:, np.arange(nv), nv + np.arange(nv)] += 1.0
    offsets = step_s * qvel_of(model, states[1:])
    moved = step_s * by_offset(inverse.tree, offsets, change)
    moved[:, :, :nv] += by_start(inverse.tree, offsets)
    whole = np.concatenate((moved, change), axis=1).astype(np.float32)
    return Transitions(whole[..., : 2 * nv], whole[..., 2 * nv :], wrench.astype(np.float32))


def by_start(tree: Tree, offsets: Array) -> Array:
    """E (N, V, V): how q ⊕ o changes with q, for moves by offsets o (N, V)."""
    return tree.blocks(np.ones_like(offsets), rotations.matrix(rotations.exp(-offsets[:, tree.turns])))


def by_offset(tree: Tree, offsets: Array, changes: Array) -> Array:
    """R δ (N, V, X): how q ⊕ o changes with changes δ (N, V, X) of offsets o (N, V)."""
    moved, rows = changes.copy(), tree.turns
    moved[:, rows] = rotations.left_jacobian(-offsets[:, rows]) @ changes[:, rows]  # J_r(v) = J_l(-v)
    return moved


class PointSlopes:
    """How points and the centre of mass of a tree of bodies move with the coordinates."""

    def __init__(self, model: mujoco.MjModel, tree: Tree, sites: IntArray, body: int) -> None:
        """Of sites (M,) and the tree below a body, both below one root."""
        self._sites, self._root = sites, int(model.body_rootid[body])
        self._moves_site = tree.carries[model.site_bodyid[sites]]  # (M, V)
        below = np.zeros(model.nbody, bool)
        for own in range(body, model.nbody):
            below[own] = own == body or below[model.body_parentid[own]]
        self._shares = tree.carries.T * (below * model.body_mass / model.body_mass[below].sum())  # (V, B)

    def at(self, data: mujoco.MjData) -> tuple[Array, Array]:
        """Derivatives of the points (M, 3, V) and of the centre of mass (3, V) by tangents of q.

        Args:
            data: with kinematics and centres of mass (`poses.posed`).
        """
        turn, shift = data.cdof[:, :3], data.cdof[:, 3:]  # (V, 3), the shift that of the root's centre
        origin = data.subtree_com[self._root]
        arms = data.site_xpos[self._sites] - origin  # (M, 3)
        points = (shift + cross(turn, arms[:, None])) * self._moves_site[..., None]  # (M, V, 3)
        moments = self._shares @ (data.xipos - origin)  # (V, 3)
        com = self._shares.sum(axis=1)[:, None] * shift + cross(turn, moments)  # (V, 3)
        return points.swapaxes(1, 2), com.T
