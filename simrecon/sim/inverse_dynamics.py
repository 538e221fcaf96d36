"""Inverse dynamics of a motion under known forces of the scene."""

from __future__ import annotations

import mujoco
import numpy as np

from simrecon.types import Array, IntArray


def inverse(
    model: mujoco.MjModel, qpos: Array, interval_s: float, bodies: IntArray, places_m: Array, forces_N: Array
) -> Array:
    """Generalised forces (T, nv) that a motion takes beside given ones: M v̇ + c - Σ Jᵀ f.

    Args:
        model: whose own contacts, limits and motors are left out.
        qpos: (T, nq).
        interval_s: between frames; velocities and accelerations are finite differences.
        bodies: (C,) on which the forces act.
        places_m: (T, C, 3) where they act, in the world.
        forces_N: (T, C, 3).
    """
    steps = np.empty((len(qpos) - 1, model.nv))
    for step, before, after in zip(steps, qpos[:-1], qpos[1:], strict=True):
        mujoco.mj_differentiatePos(model, step, interval_s, before, after)
    rates = np.concatenate((steps[:1], (steps[1:] + steps[:-1]) / 2, steps[-1:]))
    between = np.diff(steps, axis=0) / interval_s
    accelerations = np.concatenate((between[:1], between, between[-1:]))
    data, needed, moved = mujoco.MjData(model), np.empty((len(qpos), model.nv)), np.zeros(model.nv)
    flags = model.opt.disableflags
    off = mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_ACTUATION
    model.opt.disableflags = flags | off
    try:
        for frame in range(len(qpos)):
            data.qpos[:], data.qvel[:], data.qacc[:] = qpos[frame], rates[frame], accelerations[frame]
            mujoco.mj_inverse(model, data)
            needed[frame] = data.qfrc_inverse
            for body, place, force in zip(bodies.tolist(), places_m[frame], forces_N[frame], strict=True):
                moved[:] = 0.0
                mujoco.mj_applyFT(model, data, force, np.zeros(3), place, body, moved)
                needed[frame] -= moved
    finally:
        model.opt.disableflags = flags
    return needed
