"""Derivatives of the inverse dynamics of a tree of rigid bodies, for many states at once.

With S_j the axis of a degree of freedom j, U_k and A_k velocity and acceleration of what k does not move, E_k
the velocity after its joint, w_k = U_k × S_k, and composite inertias, momentum matrices and forces Iᶜ, Bᶜ, Fᶜ
of all that a body carries, B_i w = V_i ×* I_i w - I_i (V_i × w) + w ×* I_i V_i,

    ∂τ_j/∂q_k = S_jᵀ (Iᶜ a_k + Bᶜ w_k [+ S_k ×* Fᶜ_k]),    a_k = -S_k × A_k - w_k × U_k,
    ∂τ_j/∂v_k = S_jᵀ (Iᶜ c_k + Bᶜ S_k),                    c_k = w_k + E_k × S_k,

of the deeper one's body; the bracket only where k does not move the axis of j. Source: J. Carpentier and
N. Mansard, "Analytical Derivatives of Rigid Body Dynamics Algorithms", RSS 2018, with MuJoCo's coordinates:
free joints shift along the axes of the world, all turns are about axes of the body.

Axes: N states, V degrees of freedom, B bodies.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from simrecon.sim import spatial
from simrecon.sim.tree import Tree
from simrecon.types import Array


@dataclass(frozen=True, eq=False)
class Motion:
    """What a model does in N states, in MuJoCo's frames about the centre of mass of each tree.

    Attributes:
        axes: (N, V, 6) S. inertias: (N, B, 10). qvel, qacc: (N, V).
    """

    axes: Array
    inertias: Array
    qvel: Array
    qacc: Array


class Rigid:
    """Slopes of a model's inverse dynamics, and what all that depends on the motion of bodies needs.

    Attributes:
        tree: of the model.
        axes: (N, V, 6) S.
        carried: (N, V, 6) w_k = U_k × S_k.
        push: (N, V, 6) Σ S_j q̈_j of what k does not move.
    """

    def __init__(self, model: mujoco.MjModel, tree: Tree, motion: Motion) -> None:
        """Velocities and accelerations of all bodies."""
        self.tree, self.axes = tree, motion.axes
        axes, carries = motion.axes, tree.carries.astype(float)
        rates = axes * motion.qvel[..., None]  # (N, V, 6)
        before = tree.before.astype(float)
        unmoved = before.T @ rates  # (N, V, 6) U
        self._after = tree.after.astype(float).T @ rates  # E
        self.carried = spatial.cross_motion(unmoved, axes)
        self.push = before.T @ (axes * motion.qacc[..., None])
        accelerations = axes * motion.qacc[..., None] + self.carried * motion.qvel[..., None]
        fall = np.concatenate((np.zeros(3), -model.opt.gravity))
        self._rest = before.T @ accelerations + fall  # A of what k does not move
        self.velocity = carries @ rates  # (N, B, 6) V
        self._fixed = -spatial.cross_motion(axes, self._rest) - spatial.cross_motion(self.carried, unmoved)
        inertia = spatial.inertia(motion.inertias)  # (N, B, 6, 6)
        momentum = (inertia @ self.velocity[..., None])[..., 0]
        force = (inertia @ (carries @ accelerations + fall)[..., None])[..., 0]
        force += spatial.cross_force(self.velocity, momentum)
        spin = spatial.matrix_force(self.velocity) @ inertia - inertia @ spatial.matrix_motion(self.velocity)
        spin += spatial.matrix_momentum(momentum)
        below = carries.T  # (V, B): what k carries
        count = len(axes)

        def composite(each: Array) -> Array:
            flat = below @ each.reshape(count, each.shape[1], -1)
            return flat.reshape(count, len(below), *each.shape[2:])

        self._inertia, self._spin, self._force = composite(inertia), composite(spin), composite(force)

    def by_position(self) -> Array:
        """∂τ/∂q (N, V, V)."""
        slope = self._slope(self._fixed, self.carried)
        carried = spatial.cross_force(self.axes, self._force)
        still = self.tree.above & ~self.tree.moves
        return slope + still * (self.axes @ carried.swapaxes(1, 2))

    def by_velocity(self) -> Array:
        """∂τ/∂v (N, V, V)."""
        return self._slope(self.carried + spatial.cross_motion(self._after, self.axes), self.axes)

    def _slope(self, pushed: Array, turned: Array) -> Array:
        """S_jᵀ (Iᶜ a_k + Bᶜ w_k) of the deeper one's body, for a, w (N, V, 6)."""
        own = (self._inertia @ pushed[..., None] + self._spin @ turned[..., None])[..., 0]
        upper = self.axes @ own.swapaxes(1, 2)  # [j, k] with k deeper
        by_a = (self._inertia.swapaxes(-1, -2) @ self.axes[..., None])[..., 0]
        by_w = (self._spin.swapaxes(-1, -2) @ self.axes[..., None])[..., 0]
        lower = by_a @ pushed.swapaxes(1, 2) + by_w @ turned.swapaxes(1, 2)  # [j, k] with j deeper
        above = self.tree.above
        slope: Array = np.where(above, upper, above.T * lower)
        return slope
