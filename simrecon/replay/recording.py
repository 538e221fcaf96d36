"""The motion and the audit of a clip, read off one plain replay of its control."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from simrecon import scene as scenes
from simrecon import schedule
from simrecon.engines.problem import Problem
from simrecon.replay.trace import Trace, mean_since, replay
from simrecon.sim.address import locate, with_items_at_rest
from simrecon.sim.poses import differentiate, posed
from simrecon.sim.state import initial_state, qpos_of, qvel_of
from simrecon.types import Array, IntArray, KinematicFit, Motion, WindowResult

SIMULATED, FALLBACK = 0, 1
"""Values of `Motion.status`."""
Mask = NDArray[np.bool_]
NO_STEP = -1
"""`Motion.frame_step` of a frame that was not simulated."""
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
    are those of the simulation, whatever their sign.

    Args:
        problem: what the engine worked on.
        fit: kinematic fit, on the problem's frames.
        windows: solved windows in order, from the first one on; may be fewer than the clip has, or none.
        times_s: (T,) of the evidence.
        grid: (T,) the problem's frame that shows each of them, not decreasing.

    Returns:
        The motion, and the audit of its replay.
    """
    model = problem.model
    parts = tuple(primitive.name for primitive in fit.body.primitives)
    state0, ctrl = _control(problem, windows)
    trace = replay(model, state0, ctrl, parts)
    steps = grid * problem.clock.stride
    simulated = steps <= len(ctrl)  # (T,)
    qpos, qvel = _configurations(problem, trace, grid, simulated)
    points, com, lowest = _geometry(problem, parts, qpos)
    fitted = with_items_at_rest(model, fit.qpos)
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
        contact_body=parts,
        kinematic_qpos=fitted[grid],
        planned_qpos=None if np.array_equal(fitted, problem.qpos) else problem.qpos[grid],
        **_loads(trace, steps, simulated),
    )
    return motion, _audit(trace, windows, lowest[simulated])


def _control(problem: Problem, windows: tuple[WindowResult, ...]) -> tuple[Array, Array]:
    """Initial state (nstate,) and control (N, nu)."""
    if windows:
        return windows[0].states[0], schedule.stitch(windows)
    state = initial_state(problem.model, problem.qpos[0], problem.qvel0)
    return state, np.empty((0, problem.model.nu))


def _configurations(problem: Problem, trace: Trace, grid: IntArray, simulated: Mask) -> tuple[Array, Array]:
    """`qpos` (T, nq) and `qvel` (T, nv): of the simulation where there is one, else of the kinematic fit."""
    model = problem.model
    states = trace.states[(grid * problem.clock.stride)[simulated]]  # (S, nstate)
    qpos, qvel = problem.qpos[grid], differentiate(model, problem.qpos, problem.clock.frame_s)[grid]
    qpos[simulated], qvel[simulated] = qpos_of(model, states), qvel_of(model, states)
    return qpos, qvel


def _loads(trace: Trace, steps: IntArray, simulated: Mask) -> dict[str, Array]:
    """Torques and contacts at T frames, as fields of `Motion`: means since the frame before."""

    def mean(rows: Array) -> Array:
        """Mean of rows (N + 1, ...), (T, ...); zero in frames that are not simulated."""
        values = np.zeros((len(steps), *rows.shape[1:]))
        values[simulated] = mean_since(rows, steps[simulated])
        return values

    pressure = mean(trace.pressure_N)[..., None]  # (T, C, 1)
    centre, slip = (np.full((*pressure.shape[:2], width), np.nan) for width in (3, 1))
    np.divide(mean(trace.moment_Nm), pressure, out=centre, where=pressure > 0)
    np.divide(mean(trace.slip_Nmps)[..., None], pressure, out=slip, where=pressure > 0)
    force = mean(trace.force_N)  # (T, C, 3)
    return {
        "torque_Nm": mean(trace.torque_Nm),
        "contact_force_N": force,
        "contact_point_m": centre,
        "contact_slip_mps": slip[..., 0],
        "grf_N": force.sum(axis=1),
    }


def _audit(trace: Trace, windows: tuple[WindowResult, ...], lowest_m: Array) -> Audit:
    """What must be zero by construction, of a trace and the heights (S,) of the lowest point."""
    depth_mm = 1e3 * np.maximum(0.0, -lowest_m)
    return Audit(
        max_root_actuator_force_N=trace.root_force_N,
        max_applied_force_N=trace.applied_force_N,
        replay_exact=_exact(trace.states, windows),
        self_penetration_max_mm=1e3 * trace.self_depth_m,
        floor_penetration_mean_mm=float(depth_mm.mean()),
        floor_penetration_max_mm=float(depth_mm.max()),
    )


def _geometry(problem: Problem, parts: tuple[str, ...], qpos: Array) -> tuple[Array, Array, Array]:
    """Points (T, M, 3), centre of mass (T, 3) and height of the lowest point (T,) of qpos (T, nq).

    The height is over the ground, negative under it, and never above one metre.
    """
    model, ground = problem.model, problem.model.geom(scenes.GROUND_GEOM).id
    person = locate(model)
    geoms = person.geoms(model, parts)
    points, com = np.empty((len(qpos), len(problem.point_rows), 3)), np.empty((len(qpos), 3))
    lowest = np.empty(len(qpos))
    for frame, data in enumerate(posed(model, qpos)):
        points[frame], com[frame] = data.site_xpos[problem.point_rows], data.subtree_com[person.body]
        heights = (mujoco.mj_geomDistance(model, data, ground, i, _DISTANCE_MAX_M, None) for i in geoms)
        lowest[frame] = min(heights)
    return points, com, lowest


def _exact(states: Array, windows: tuple[WindowResult, ...]) -> bool:
    """Whether the states (N + 1, nstate) of the replay are those of the windows."""
    start = 0
    for window in windows:
        end = start + len(window.ctrl)
        if not np.array_equal(states[start : end + 1], window.states):
            return False
        start = end
    return True
