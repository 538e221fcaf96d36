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
from simrecon.types import Array


@dataclass(frozen=True, eq=False)
class Reaction:
    """Of all fixed things on one body, in one step.

    Attributes:
        step: which; body: which; root: first of the six degrees of freedom of the free joint of its tree.
        wrench: (6,) w. changes: (6, 6) ∂w/∂q of those six, by rows.
        by_velocity, by_push: (6, 6) w_V, w_P; both are symmetric.
    """

    step: int
    body: int
    root: int
    wrench: Array
    changes: Array
    by_velocity: Array
    by_push: Array


def by_position(rigid: Rigid, reactions: Sequence[Reaction]) -> Array:
    """∂(Jᵀ w)/∂q (N, V, V) of all reactions in N steps."""
    tree, slope = rigid.tree, np.zeros((*rigid.axes.shape[:2], rigid.axes.shape[1]))
    if not reactions:
        return slope
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
    on = tree.carries[bodies].astype(float)  # (C, V)
    own = axes @ (axes @ rigidly + others).swapaxes(1, 2)
    own -= tree.moves * (axes @ spatial.cross_force(axes, wrench[:, None]).swapaxes(1, 2))
    np.add.at(slope, steps, own * on[:, :, None] * on[:, None, :])
    return slope
