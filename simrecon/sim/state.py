"""Full integration states, and the plain loop that commits and replays them bit for bit."""

from __future__ import annotations

import mujoco
import numpy as np

from simrecon.sim.quiet import unlogged
from simrecon.types import Array

STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
"""What MuJoCo must know to go on from a state with the same bits."""


def initial_state(model: mujoco.MjModel, qpos: Array, qvel: Array) -> Array:
    """Full integration state (nstate,) at rest of everything but qpos (nq,) and qvel (nv,)."""
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = qpos, qvel
    return get_state(model, data)


def get_state(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """The full integration state (nstate,) of `data`."""
    state = np.empty(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    return state


def set_state(model: mujoco.MjModel, data: mujoco.MjData, state: Array) -> None:
    """Put `data` into a full integration state (nstate,)."""
    mujoco.mj_setState(model, data, state, STATE)


def forward(model: mujoco.MjModel, state: Array) -> mujoco.MjData:
    """Data with all position- and velocity-dependent fields of a full state computed."""
    data = mujoco.MjData(model)
    set_state(model, data, state)
    mujoco.mj_forward(model, data)
    return data


def simulate(model: mujoco.MjModel, state: Array, ctrl: Array) -> Array:
    """States (N + 1, nstate) of a plain mj_step loop under ctrl (N, nu), the first included."""
    data = mujoco.MjData(model)
    set_state(model, data, state)
    states = [get_state(model, data)]
    with unlogged():
        for row in ctrl:
            data.ctrl[:] = row
            mujoco.mj_step(model, data)
            states.append(get_state(model, data))
    return np.stack(states)


def component(model: mujoco.MjModel, states: Array, which: mujoco.mjtState) -> Array:
    """One component, such as `mjSTATE_QPOS`, of full states (..., nstate): a view."""
    bit = int(which)
    start = mujoco.mj_stateSize(model, STATE & (bit - 1))
    return states[..., start : start + mujoco.mj_stateSize(model, bit)]


def qpos_of(model: mujoco.MjModel, states: Array) -> Array:
    """Configurations (..., nq) of full states (..., nstate): a view."""
    return component(model, states, mujoco.mjtState.mjSTATE_QPOS)


def qvel_of(model: mujoco.MjModel, states: Array) -> Array:
    """Velocities (..., nv) of full states (..., nstate): a view."""
    return component(model, states, mujoco.mjtState.mjSTATE_QVEL)


def displace(model: mujoco.MjModel, states: Array, pose: Array, velocity: Array) -> None:
    """Move full states (P, nstate), in place, by offsets of pose and velocity, (P, nv) each."""
    velocities = qvel_of(model, states)
    velocities += velocity
    for row, offset in zip(qpos_of(model, states), np.ascontiguousarray(pose), strict=True):
        mujoco.mj_integratePos(model, row, offset, 1.0)


def state_size(model: mujoco.MjModel) -> int:
    """How many numbers a full state has."""
    return int(mujoco.mj_stateSize(model, STATE))
