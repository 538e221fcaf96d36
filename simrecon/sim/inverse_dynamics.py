"""Inverse dynamics of a motion under known forces of the scene."""

from __future__ import annotations

import mujoco
import numpy as np

from simrecon.types import Array, IntArray


def inverse(
    model: mujoco.MjModel,
    qpos: Array,
    interval_s: float,
    bodies: IntArray,
    places_m: Array,
    forces_N: Array,
    moments_Nm: Array | None = None,
) -> Array:
    """Generalised forces (T, nv) that a motion takes beside given ones: M v̇ + c - Σ Jᵀ f.

    Args:
        model: whose own contacts, limits and motors are left out.
        qpos: (T, nq).
        interval_s: between frames; velocities and accelerations are finite differences.
        bodies: (C,) on which the forces act.
        places_m: (T, C, 3) where they act, in the world.
        forces_N: (T, C, 3).
        moments_Nm: (T, C, 3) about these places; None: there are none.
    """
    if moments_Nm is None:
        moments_Nm = np.zeros_like(forces_N)
    steps = _differences(model, qpos, interval_s)
    speeds = _middles(steps)
    between = np.diff(steps, axis=0) / interval_s
    accelerations = np.concatenate((between[:1], between, between[-1:]))
    data, needed, moved = mujoco.MjData(model), np.empty((len(qpos), model.nv)), np.zeros(model.nv)
    flags = model.opt.disableflags
    off = mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_ACTUATION
    model.opt.disableflags = flags | off
    try:
        for frame in range(len(qpos)):
            data.qpos[:], data.qvel[:], data.qacc[:] = qpos[frame], speeds[frame], accelerations[frame]
            mujoco.mj_inverse(model, data)
            needed[frame] = data.qfrc_inverse
            loads = zip(bodies.tolist(), places_m[frame], forces_N[frame], moments_Nm[frame], strict=True)
            for body, place, force, moment in loads:
                if not (force.any() or moment.any()):
                    continue
                moved[:] = 0.0
                mujoco.mj_applyFT(model, data, force, moment, place, body, moved)
                needed[frame] -= moved
    finally:
        model.opt.disableflags = flags
    return needed


def rates(model: mujoco.MjModel, qpos: Array, interval_s: float) -> Array:
    """The velocities (T, nv) that `inverse` takes a motion (T, nq) to have."""
    return _middles(_differences(model, qpos, interval_s))


def _differences(model: mujoco.MjModel, qpos: Array, interval_s: float) -> Array:
    steps = np.empty((len(qpos) - 1, model.nv))
    for step, before, after in zip(steps, qpos[:-1], qpos[1:], strict=True):
        mujoco.mj_differentiatePos(model, step, interval_s, before, after)
    return steps


def _middles(steps: Array) -> Array:
    """What lies between steps (T - 1, ...), at their ends (T, ...)."""
    return np.concatenate((steps[:1], (steps[1:] + steps[:-1]) / 2, steps[-1:]))
