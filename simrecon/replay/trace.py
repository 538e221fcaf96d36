"""The plain loop: every step of the simulation, with its contact forces and torques.

Row k of what the loop records belongs to the step that ends in state k: its contact forces and torques acted
from state k - 1 to state k. Row 0 is what acts at `state0`, by one forward evaluation on the side.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from simrecon.sim import contacts
from simrecon.sim.address import locate, motor_dofs
from simrecon.sim.state import STATE, forward, set_state
from simrecon.types import Array, IntArray, Motion

ROOT_DOFS = 6


@dataclass(frozen=True, eq=False)
class Trace:
    """Rows of N + 1 steps and C parts.

    Attributes:
        states: (N + 1, nstate).
        force_N: (N + 1, C, 3) of the scene on each part; pressure_N: (N + 1, C) sum of the normal forces.
        moment_Nm: (N + 1, C, 3) sum of normal force times place of contact.
        couple_Nm: (N + 1, C, 3) moment of the forces about the world's origin.
        slip_Nmps: (N + 1, C) sum of normal force times slip.
        torque_Nm: (N + 1, nu).
        root_force_N: largest component of a motor on the free root.
        applied_force_N: largest component of any force from outside.
        self_depth_m: deepest contact between two parts.
    """

    states: Array
    force_N: Array
    pressure_N: Array
    moment_Nm: Array
    couple_Nm: Array
    slip_Nmps: Array
    torque_Nm: Array
    root_force_N: float
    applied_force_N: float
    self_depth_m: float


class _Rows:
    """The rows of a trace while they are filled."""

    def __init__(self, model: mujoco.MjModel, rows: int, parts: tuple[str, ...]) -> None:
        self.model = model
        self.states = np.zeros((rows, mujoco.mj_stateSize(model, STATE)))
        self.force, self.moment, self.couple = np.zeros((3, rows, len(parts), 3))
        self.pressure, self.slip = np.zeros((2, rows, len(parts)))
        self.torque = np.zeros((rows, model.nu))
        self.root = self.applied = self.depth = 0.0
        self._parts = np.full(model.ngeom, -1)
        self._parts[locate(model).geoms(model, parts)] = np.arange(len(parts))

    def read(self, k: int, data: mujoco.MjData) -> None:
        """Add the contacts and outer forces of `data` to row k."""
        self.depth = max(self.depth, contacts.deepest_between_parts_m(data, self._parts))
        self.root = max(self.root, np.abs(data.qfrc_actuator[:ROOT_DOFS]).max())
        self.applied = max(self.applied, np.abs(data.qfrc_applied).max(), np.abs(data.xfrc_applied).max())
        touching = contacts.find(data, self._parts)
        if not len(touching.rows):
            return
        force, normal = contacts.forces(self.model, data, touching)
        slip, places = contacts.slip_mps(self.model, data, touching), data.contact.pos[touching.rows]
        np.add.at(self.force[k], touching.part, force)
        np.add.at(self.pressure[k], touching.part, normal)
        np.add.at(self.moment[k], touching.part, normal[:, None] * places)
        np.add.at(self.couple[k], touching.part, np.cross(places, force))
        np.add.at(self.slip[k], touching.part, normal * slip)


Gaps = tuple[tuple[int, int, Array], ...]
"""Last step before each gap, the step at which the simulation begins anew, and its state there (nstate,)."""


def gaps_of(motion: Motion) -> Gaps:
    """Those of a motion."""
    if motion.restart_step is None or motion.restart_state is None:
        return ()
    steps = motion.frame_step
    return tuple(
        (int(steps[(steps >= 0) & (steps < begin)].max(initial=0)), int(begin), state)
        for begin, state in zip(motion.restart_step, motion.restart_state, strict=True)
    )


def replay(
    model: mujoco.MjModel, state0: Array, ctrl: Array, parts: tuple[str, ...], gaps: Gaps = ()
) -> Trace:
    """Step from a state (nstate,) under a control (N, nu) and read every step.

    Args:
        model: of person and scene.
        state0: full integration state.
        ctrl: (N, nu).
        parts: C names of the body's primitives.
        gaps: in which nothing is stepped; the rows of their steps are zero.
    """
    rows = _Rows(model, len(ctrl) + 1, parts)
    data = mujoco.MjData(model)
    anew = {0: state0} | {begin: state for _, begin, state in gaps}
    for k in range(len(ctrl) + 1):
        if any(last < k < begin for last, begin, _ in gaps):
            continue
        if k in anew:
            set_state(model, data, anew[k])
            now = forward(model, anew[k])  # apart from `data`, whose solver warm start it would change
            rows.torque[k] = now.actuator_force
        else:
            now, before = data, data.qvel.copy()
            data.ctrl[:] = ctrl[k - 1]
            mujoco.mj_step(model, data)
            rows.torque[k] = _acting_torque(model, data, before)
        mujoco.mj_getState(model, data, rows.states[k], STATE)
        rows.read(k, now)
    return Trace(
        rows.states,
        rows.force,
        rows.pressure,
        rows.moment,
        rows.couple,
        rows.slip,
        rows.torque,
        float(rows.root),
        float(rows.applied),
        float(rows.depth),
    )


def _acting_torque(model: mujoco.MjModel, data: mujoco.MjData, before: Array) -> Array:
    """Torque (nu,) of the motors over the last step.

    The `discrete` integrator takes stiffness and damping at the end of the step: of the force f at its start
    there acts f - k h v' - d (v' - v), with v and v' the joint velocities before and after; where f is at its
    limit, f itself.

    Args:
        model: with PD motors on ball joints.
        data: after the step.
        before: (nv,) velocities before it.
    """
    dofs = motor_dofs(model)
    stiffness, damping = model.actuator_gainprm[:, 0], -model.actuator_biasprm[:, 2]
    force = data.actuator_force
    after = data.qvel[dofs]
    implicit = force - stiffness * model.opt.timestep * after - damping * (after - before[dofs])
    low, high = model.actuator_forcerange.T
    return np.asarray(np.where((force <= low) | (force >= high), force, implicit))


def mean_since(rows: Array, steps: IntArray, begins: IntArray | None = None) -> Array:
    """Means of rows (N + 1, ...) over the steps since the previous one of `steps` (S,), (S, ...).

    A frame at the same step as the previous one shows the same, and one of the steps `begins` (R,), at which
    a simulation begins after a gap, its own row; rows of gaps are zero.
    """
    unique, inverse = np.unique(steps, return_inverse=True)
    starts = np.concatenate(([0], unique[:-1] + 1))
    if begins is not None:
        starts = np.where(np.isin(unique, begins), unique, starts)
    total = np.add.reduceat(rows[: unique[-1] + 1], starts, axis=0)
    count = (unique - starts + 1).reshape(-1, *(1,) * (rows.ndim - 1))
    return np.asarray((total / count)[inverse])
