"""First velocities of a clip that begins in flight, from what flight keeps.

Between take-off and landing the centre of mass c follows a parabola and the angular momentum L about it is
constant, so all frames of the flight say what both are at its start:

    c(t) + g t² / 2 = c₀ + v₀ t,        L = mean over frames of L(q, q̇)

Finite differences of the first three frames know far less. The root's angular velocity is corrected by the δ
of

    min |I δ - (L - L₀)|² / (ε |L|)² + |δ|² / s²,

with L₀ the momentum of the differences, I the inertia, ε the error of an orientation and s that of the
differences: about the long axis, with little inertia, L turned by ε says less than they do. The velocities of
the joints stay as they are.
"""

from __future__ import annotations

import itertools

import mujoco
import numpy as np

from simrecon.sim.address import locate
from simrecon.sim.poses import differentiate, posed
from simrecon.types import Array

CLEAR_M, FRAMES_MIN, SPAN_S = 0.03, 4, 0.4
"""Flight: no part within this of anything, over so many frames at least; and how much of it is looked at."""
ORIENTATION_RAD, SPIN_RADPS = 0.02, 1.0
"""ε and s: 0.02 rad a frame at 30 frames a second make 0.9 rad/s of one difference."""


def first_velocity(model: mujoco.MjModel, qpos: Array, interval_s: float) -> Array:
    """Velocity (nv,) at the first frame: by finite differences, with the momenta of the flight if it flies.

    Args:
        model: of person and scene.
        qpos: (T, nq).
        interval_s: between frames.
    """
    frames = flight(model, qpos[: round(SPAN_S / interval_s) + 1])
    first: Array = differentiate(model, qpos[:3], interval_s)[0]
    if frames < FRAMES_MIN:
        return first
    return with_momenta(model, qpos[:frames], first, interval_s)


def flight(model: mujoco.MjModel, qpos: Array) -> int:
    """Number of frames (T, nq) from the first one on in which the person touches nothing.

    None among height fields, to which MuJoCo measures no distance.
    """
    if (model.geom_type == mujoco.mjtGeom.mjGEOM_HFIELD).any():
        return 0
    own = np.asarray(locate(model).own_geoms(model), bool)  # (ngeom,)
    solid = (model.geom_contype | model.geom_conaffinity) > 0
    pairs = list(itertools.product(np.flatnonzero(~own & solid), np.flatnonzero(own & solid)))
    for frame, data in enumerate(posed(model, qpos)):
        for item, part in pairs:
            if mujoco.mj_geomDistance(model, data, item, part, 2 * CLEAR_M, None) < CLEAR_M:
                return frame
    return len(qpos)


def with_momenta(model: mujoco.MjModel, qpos: Array, first: Array, interval_s: float) -> Array:
    """Velocities `first` (nv,), the root's changed so that both momenta are those of the flight (T, nq)."""
    times_s = interval_s * np.arange(len(qpos))
    com, _, spins = _momenta(model, qpos, differentiate(model, qpos, interval_s))
    path = com - 0.5 * times_s[:, None] ** 2 * model.opt.gravity  # (T, 3)
    linear = np.polynomial.polynomial.polyfit(times_s, path, 1)[1]  # (3,) v₀
    angular = np.mean(spins[1:-1], axis=0)  # (3,) L, of central differences alone

    def at_start(velocities: Array) -> tuple[Array, Array]:
        """Velocity of the centre of mass and angular momentum, (K, 3) each, for velocities (K, nv)."""
        return _momenta(model, np.repeat(qpos[:1], len(velocities), axis=0), velocities)[1:]

    inertia = np.ascontiguousarray(at_start(np.eye(model.nv)[3:6])[1].T)  # (3, 3)
    weights = inertia.T / (ORIENTATION_RAD * np.linalg.norm(angular) + 1e-9) ** 2  # (3, 3)
    lacking = angular - at_start(first[None])[1][0]
    changed = first.copy()
    changed[3:6] += np.linalg.solve(weights @ inertia + np.eye(3) / SPIN_RADPS**2, weights @ lacking)
    changed[:3] += linear - at_start(changed[None])[0][0]
    return changed


def _momenta(model: mujoco.MjModel, qpos: Array, qvel: Array) -> tuple[Array, Array, Array]:
    """Centre of mass, its velocity, and the angular momentum about it, (T, 3) each, of qpos and qvel."""
    body = locate(model).body
    fields = [
        [field[body].copy() for field in (data.subtree_com, data.subtree_linvel, data.subtree_angmom)]
        for data in posed(model, qpos, qvel)
    ]
    com, linear, angular = np.array(fields).swapaxes(0, 1)
    return com, linear, angular
