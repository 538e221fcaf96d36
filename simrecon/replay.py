"""The final replay: one plain mj_step loop that reads every frame, and what the scene did to the body.

Row k of what the loop records belongs to the step that ends in state k: its contact forces and torques acted
from state k - 1 to state k. Row 0 is what acts at `state0`, by one forward evaluation on the side.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from simrecon import scene as scenes
from simrecon import schedule
from simrecon.engines.problem import Problem
from simrecon.sim.address import locate
from simrecon.sim.poses import differentiate
from simrecon.sim.state import STATE, component, forward, initial_state, set_state
from simrecon.types import Array, IntArray, KinematicFit, Motion, WindowResult

SIMULATED, FALLBACK = 0, 1
"""Values of `Motion.status`."""
NO_STEP = -1
"""`Motion.frame_step` of a frame that was not simulated."""

ROOT_DOFS = 6
_DISTANCE_MAX_M = 1.0


@dataclass(frozen=True)
class Audit:
    """What must be zero by construction, measured in the final replay.

    Attributes:
        max_root_actuator_force_N: largest component (N or Nm) of a motor on the free root.
        max_applied_force_N: largest component (N or Nm) of any force applied from outside the simulation.
        replay_exact: the replay's states equal those of the windows to the last bit.
        self_penetration_max_mm: deepest contact between two parts of the body, over all steps.
        floor_penetration_mean_mm, floor_penetration_max_mm: depth of the body's lowest point under the
            ground, over the simulated frames.
    """

    max_root_actuator_force_N: float
    max_applied_force_N: float
    replay_exact: bool
    self_penetration_max_mm: float
    floor_penetration_mean_mm: float
    floor_penetration_max_mm: float


def record(
    problem: Problem, fit: KinematicFit, windows: tuple[WindowResult, ...], times_s: Array, grid: IntArray
) -> tuple[Motion, Audit]:
    """Replay the control of all windows and read the motion off the simulation.

    Frames past the last committed step show the kinematic fit, with status `FALLBACK`, `frame_step` -1,
    velocities by finite differences and no forces; without any window, that is all but the first. Quaternions
    are those of the simulation, whatever their sign. Torques are MuJoCo's `actuator_force`, from which the
    implicit integrator departs within a step (docs/formats.md).

    Args:
        problem: what the engine worked on.
        fit: kinematic fit, on the problem's frames.
        windows: solved windows in order, from the first one on; may be fewer than the clip has, or none.
        times_s: (T,) of the evidence.
        grid: (T,) the problem's frame that shows each of them, not decreasing.

    Returns:
        The motion, and the audit of its replay.
    """
    model, stride = problem.model, problem.clock.stride
    parts = tuple(primitive.name for primitive in fit.body.primitives)
    state0, ctrl = _control(problem, windows)
    trace = _replay(model, state0, ctrl, parts)

    steps = grid * stride
    simulated = steps <= len(ctrl)  # (T,)
    read = trace.states[steps[simulated]]  # (S, nstate)
    qpos, qvel = problem.qpos[grid], differentiate(model, problem.qpos, problem.clock.frame_s)[grid]
    qpos[simulated] = component(model, read, mujoco.mjtState.mjSTATE_QPOS)
    qvel[simulated] = component(model, read, mujoco.mjtState.mjSTATE_QVEL)
    points, com, lowest = _geometry(problem, parts, qpos)

    def mean(rows: Array, missing: float = 0.0) -> Array:
        """Mean of rows (N + 1, ...) since the previous frame, (T, ...)."""
        found = np.full((len(grid), *rows.shape[1:]), missing)
        found[simulated] = mean_since(rows, steps[simulated])
        return found

    pressure = mean(trace.pressure_N)[..., None]  # (T, C, 1)
    centre, slip = (np.full((*pressure.shape[:2], width), np.nan) for width in (3, 1))
    np.divide(mean(trace.moment_Nm), pressure, out=centre, where=pressure > 0)
    np.divide(mean(trace.slip_Nmps)[..., None], pressure, out=slip, where=pressure > 0)
    force = mean(trace.force_N)  # (T, C, 3)
    motion = Motion(
        times_s=times_s,
        frame_step=np.where(simulated, steps, NO_STEP),
        status=np.where(simulated, SIMULATED, FALLBACK).astype(np.uint8),
        qpos=qpos,
        qvel=qvel,
        state0=state0,
        ctrl=ctrl,
        joint_names=fit.body.skeleton.point_names,
        joints_m=points,
        com_m=com,
        torque_Nm=mean(trace.torque_Nm),
        contact_body=parts,
        contact_force_N=force,
        contact_point_m=centre,
        contact_slip_mps=slip[..., 0],
        grf_N=force.sum(axis=1),
        kinematic_qpos=problem.qpos[grid],
    )
    depth_mm = 1e3 * np.maximum(0.0, -lowest[simulated])
    return motion, Audit(
        max_root_actuator_force_N=trace.root_force_N,
        max_applied_force_N=trace.applied_force_N,
        replay_exact=_exact(trace.states, windows),
        self_penetration_max_mm=1e3 * trace.self_depth_m,
        floor_penetration_mean_mm=float(depth_mm.mean()),
        floor_penetration_max_mm=float(depth_mm.max()),
    )


@dataclass(frozen=True, eq=False)
class _Trace:
    """What the loop wrote down in N steps; C parts of the body.

    Attributes:
        states: (N + 1, nstate).
        force_N: (N + 1, C, 3) of the scene on each part, in the world.
        pressure_N: (N + 1, C) sum of the normal forces.
        moment_Nm: (N + 1, C, 3) sum of normal force times point.
        slip_Nmps: (N + 1, C) sum of normal force times speed of the part along the surface that it touches.
        torque_Nm: (N + 1, nu).
        root_force_N, applied_force_N, self_depth_m: maxima over all steps (`Audit`).
    """

    states: Array
    force_N: Array
    pressure_N: Array
    moment_Nm: Array
    slip_Nmps: Array
    torque_Nm: Array
    root_force_N: float
    applied_force_N: float
    self_depth_m: float


def _control(problem: Problem, windows: tuple[WindowResult, ...]) -> tuple[Array, Array]:
    """Initial state (nstate,) and control (N, nu)."""
    if windows:
        return windows[0].states[0], schedule.stitch(windows)
    state = initial_state(problem.model, problem.qpos[0], problem.qvel0)
    return state, np.empty((0, problem.model.nu))


def _replay(model: mujoco.MjModel, state0: Array, ctrl: Array, parts: tuple[str, ...]) -> _Trace:
    """`replay` that also reads forces."""
    rows = len(ctrl) + 1
    states = np.empty((rows, len(state0)))
    force, moment = np.zeros((2, rows, len(parts), 3))
    pressure, slip = np.zeros((2, rows, len(parts)))
    torque = np.zeros((rows, model.nu))
    part = np.full(model.ngeom, -1)
    part[_geoms(model, parts)] = np.arange(len(parts))
    root_force = applied = depth = 0.0
    data = mujoco.MjData(model)
    set_state(model, data, state0)
    now = forward(model, state0)  # apart from `data`, whose solver warm start it would change
    for k in range(rows):
        if k > 0:
            now = data
            data.ctrl[:] = ctrl[k - 1]
            before = data.qvel.copy()
            mujoco.mj_step(model, data)
        mujoco.mj_getState(model, data, states[k], STATE)
        row = _Row(force[k], pressure[k], moment[k], slip[k])
        depth = max(depth, _read_contacts(model, now, part, row))
        torque[k] = now.actuator_force if k == 0 else _acting_torque(model, data, before)
        root_force = max(root_force, np.abs(now.qfrc_actuator[:ROOT_DOFS]).max())
        applied = max(applied, np.abs(now.qfrc_applied).max(), np.abs(now.xfrc_applied).max())
    return _Trace(
        states, force, pressure, moment, slip, torque, float(root_force), float(applied), float(depth)
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
    dofs = model.jnt_dofadr[model.actuator_trnid[:, 0]] + np.argmax(
        np.abs(model.actuator_gear[:, :3]), axis=1
    )
    stiffness, damping = model.actuator_gainprm[:, 0], -model.actuator_biasprm[:, 2]
    force = data.actuator_force
    after = data.qvel[dofs]
    implicit = force - stiffness * model.opt.timestep * after - damping * (after - before[dofs])
    low, high = model.actuator_forcerange.T
    return np.asarray(np.where((force <= low) | (force >= high), force, implicit))


@dataclass(frozen=True, eq=False)
class _Row:
    """Rows of `_Trace` of one step, to be added to: force (C, 3), pressure (C,), moment (C, 3), slip (C,)."""

    force_N: Array
    pressure_N: Array
    moment_Nm: Array
    slip_Nmps: Array


def _read_contacts(model: mujoco.MjModel, data: mujoco.MjData, part: IntArray, row: _Row) -> float:
    """Add up the contacts of the scene with each part of the body.

    Args:
        model: of `data`.
        data: with contact forces.
        part: (ngeom,) index of the part, -1 for a geom of the scene.
        row: added to.

    Returns:
        The depth of the deepest contact between two parts, m.
    """
    contact = data.contact
    if not len(contact):
        return 0.0
    pair = part[contact.geom]  # (ncon, 2)
    own = (pair >= 0).sum(axis=1)  # (ncon,) how many of the two are of the body
    depth = max(0.0, -float(contact.dist[own == 2].min(initial=0.0)))
    chosen = np.flatnonzero(own == 1)
    if not len(chosen):
        return depth
    local = np.empty((len(chosen), 6))
    for values, index in zip(local, chosen, strict=True):
        mujoco.mj_contactForce(model, data, index, values)
    # the force of a contact acts on its second geom, with the axes of the contact as rows of its frame
    sign = np.where(pair[chosen, 1] >= 0, 1.0, -1.0)[:, None]
    axes = contact.frame[chosen].reshape(-1, 3, 3)
    which = pair[chosen].max(axis=1)
    normal = local[:, :1]  # (c, 1)
    first, second = (
        _velocity(model, data, contact.geom[chosen, side], contact.pos[chosen]) for side in (0, 1)
    )  # (c, 3) each
    along = (axes[:, 1:] @ (second - first)[..., None])[..., 0]  # (c, 2) in the contact's plane
    np.add.at(row.force_N, which, sign * (local[:, None, :3] @ axes)[:, 0])
    np.add.at(row.pressure_N, which, normal[:, 0])
    np.add.at(row.moment_Nm, which, normal * contact.pos[chosen])
    np.add.at(row.slip_Nmps, which, normal[:, 0] * np.linalg.norm(along, axis=-1))
    return depth


def _velocity(model: mujoco.MjModel, data: mujoco.MjData, geoms: IntArray, points_m: Array) -> Array:
    """World velocity (c, 3) of points (c, 3) fixed to the bodies of geoms (c,)."""
    bodies = model.geom_bodyid[geoms]
    turning, moving = data.cvel[bodies, :3], data.cvel[bodies, 3:]
    arm = points_m - data.subtree_com[model.body_rootid[bodies]]
    return np.asarray(moving + np.cross(turning, arm))


def mean_since(rows: Array, steps: IntArray) -> Array:
    """Means of rows (N + 1, ...) over the steps since the previous one of `steps` (S,), (S, ...).

    A frame at the same step as the previous one shows the same.
    """
    unique, inverse = np.unique(steps, return_inverse=True)
    starts = np.concatenate(([0], unique[:-1] + 1))
    total = np.add.reduceat(rows[: unique[-1] + 1], starts, axis=0)
    count = (unique - starts + 1).reshape(-1, *(1,) * (rows.ndim - 1))
    return np.asarray((total / count)[inverse])


def _geometry(problem: Problem, parts: tuple[str, ...], qpos: Array) -> tuple[Array, Array, Array]:
    """Points (T, M, 3), centre of mass (T, 3) and height of the lowest point (T,) of qpos (T, nq).

    The height is over the ground, negative under it, and never above one metre.
    """
    model = problem.model
    data, ground = mujoco.MjData(model), model.geom(scenes.GROUND_GEOM).id
    geoms, person = _geoms(model, parts), locate(model).body
    points, com = np.empty((len(qpos), len(problem.point_rows), 3)), np.empty((len(qpos), 3))
    lowest = np.empty(len(qpos))
    for frame, configuration in enumerate(qpos):
        data.qpos[:] = configuration
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        points[frame], com[frame] = data.site_xpos[problem.point_rows], data.subtree_com[person]
        heights = (mujoco.mj_geomDistance(model, data, ground, i, _DISTANCE_MAX_M, None) for i in geoms)
        lowest[frame] = min(heights)
    return points, com, lowest


def _geoms(model: mujoco.MjModel, parts: tuple[str, ...]) -> list[int]:
    return [model.geom(name).id for name in parts]


def _exact(states: Array, windows: tuple[WindowResult, ...]) -> bool:
    """Whether the states (N + 1, nstate) of the replay are those of the windows."""
    start = 0
    for window in windows:
        end = start + len(window.ctrl)
        if not np.array_equal(states[start : end + 1], window.states):
            return False
        start = end
    return True
