"""What something fixed does to a body of the person, and how that changes with the person's joints.

Its wrench w depends on where the body is, on the velocity V of the body and on P = Σ S_j q̈_j: by six moves
of the whole person one knows Γ, how w changes when body, V and P are moved together. A degree of freedom k
moves the body by its axis S_k, but V only from U_k on, and P from P_k on, which k does not move:

    ∂w/∂q_k = Γ S_k + w_V (U_k × S_k) - w_P (S_k × P_k),
    ∂(S_jᵀ w)/∂q_k = S_jᵀ ∂w/∂q_k [- S_jᵀ (S_k ×* w)],

the bracket where k moves the axis of j.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simrecon.sim import spatial
from simrecon.sim.rigid import Rigid
from simrecon.types import Array, IntArray


@dataclass(frozen=True, eq=False)
class Reaction:
    """Of all fixed things on one body, in one step.

    Attributes:
        step: which; body: which; root: first of the six degrees of freedom of the free joint of its tree.
        centre: (3,) about which moments are. wrench: (6,) w, moment first. changes: (6, 6) ∂w/∂q of those
            six, by rows.
        by_velocity, by_push: (6, 6) w_V, w_P; both are symmetric.
    """

    step: int
    body: int
    root: int
    centre: Array
    wrench: Array
    changes: Array
    by_velocity: Array
    by_push: Array


@dataclass(frozen=True, eq=False)
class _Stack:
    """C reactions as arrays, and what they share.

    Attributes:
        steps, bodies: (C,). axes: (C, V, 6) S. on: (C, V) which degrees of freedom carry the body.
        wrench: (C, 6). by_position: (C, V, 6) ∂w/∂q, where `on`.
        by_velocity, by_push: (C, 6, 6).
    """

    steps: IntArray
    bodies: IntArray
    axes: Array
    on: Array
    wrench: Array
    by_position: Array
    by_velocity: Array
    by_push: Array

    @classmethod
    def of(cls, rigid: Rigid, reactions: Sequence[Reaction]) -> _Stack:
        """Of at least one."""
        steps, bodies = (np.array([getattr(own, name) for own in reactions]) for name in ("step", "body"))
        six = np.array([own.root for own in reactions])[:, None] + np.arange(6)  # (C, 6)
        wrench, changes, by_velocity, by_push = (
            np.array([getattr(own, name) for own in reactions])
            for name in ("wrench", "changes", "by_velocity", "by_push")
        )
        each = np.arange(len(reactions))[:, None]
        axes, carried = rigid.axes[steps], rigid.carried[steps]  # (C, V, 6)
        lag = spatial.cross_motion(axes, rigid.push[steps])
        others = carried @ by_velocity - lag @ by_push
        rigidly = np.linalg.solve(axes[each, six], changes - others[each, six])  # Γᵀ
        on = rigid.tree.carries[bodies].astype(float)  # (C, V)
        return cls(steps, bodies, axes, on, wrench, axes @ rigidly + others, by_velocity, by_push)


def by_position(rigid: Rigid, reactions: Sequence[Reaction]) -> Array:
    """∂(Jᵀ w)/∂q (N, V, V) of all reactions in N steps."""
    slope = np.zeros((*rigid.axes.shape[:2], rigid.axes.shape[1]))
    if not reactions:
        return slope
    whole = _Stack.of(rigid, reactions)
    own = whole.axes @ whole.by_position.swapaxes(1, 2)
    turned = spatial.cross_force(whole.axes, whole.wrench[:, None]).swapaxes(1, 2)
    own -= rigid.tree.moves * (whole.axes @ turned)
    np.add.at(slope, whole.steps, own * whole.on[:, :, None] * whole.on[:, None, :])
    return slope


def wrenches(rigid: Rigid, reactions: Sequence[Reaction], bodies: Sequence[int]) -> Array:
    """How wrenches on some bodies change with q, v and a of N steps, (N, K, 6, 3 V).

    Moments are about the world's origin, and come first. A body that nothing fixed touches feels nothing.
    """
    count, nv = rigid.axes.shape[:2]
    slope = np.zeros((count, len(bodies), 6, 3 * nv))
    reactions = [own for own in reactions if own.body in bodies]
    if not reactions:
        return slope
    whole = _Stack.of(rigid, reactions)
    columns = [bodies.index(own.body) for own in reactions]
    parts = (whole.by_position, whole.axes @ whole.by_velocity, whole.axes @ whole.by_push)
    own = np.concatenate([part * whole.on[..., None] for part in parts], axis=1)  # (C, 3 V, 6)
    centre = np.array([reaction.centre for reaction in reactions])
    own[..., :3] += spatial.cross(centre[:, None], own[..., 3:])
    slope[whole.steps, columns] = own.swapaxes(1, 2)
    return slope
