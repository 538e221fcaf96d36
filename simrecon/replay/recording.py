"""The motion and the audit of a clip, read off one plain replay of its control."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from simrecon import scene as scenes
from simrecon import schedule
from simrecon.engines.problem import Problem
from simrecon.replay.trace import Gaps, Trace, mean_since, replay
from simrecon.sim.address import locate, with_items_at_rest
from simrecon.sim.poses import differentiate, posed
from simrecon.sim.state import initial_state, qpos_of, qvel_of
from simrecon.types import Array, IntArray, KinematicFit, Motion, WindowResult
from simrecon.types.motion import FALLBACK, NO_STEP, SIMULATED

Mask = NDArray[np.bool_]
_DISTANCE_MAX_M = 1.0


@dataclass(frozen=True)
class Audit:
    """What must be zero by construction, measured in the final replay; None of a plan, which has no replay.

    Attributes:
        max_root_actuator_force_N: largest component (N or Nm) of a motor on the free root.
        max_applied_force_N: largest component (N or Nm) of any force applied from outside the simulation.
        replay_exact: the replay's states equal those of the windows to the last bit.
        self_penetration_max_mm: deepest contact between two parts of the body, over all steps.
        floor_penetration_mean_mm, floor_penetration_max_mm: depth of the body's lowest point under the
            ground, over the frames that show the simulation, or the plan.
    """

    max_root_actuator_force_N: float | None
    max_applied_force_N: float | None
    replay_exact: bool | None
    self_penetration_max_mm: float | None
    floor_penetration_mean_mm: float
    floor_penetration_max_mm: float


def record(
    problem: Problem, fit: KinematicFit, windows: tuple[WindowResult, ...], times_s: Array, grid: IntArray
) -> tuple[Motion, Audit]:
    """Replay the control of all windows and read the motion off the simulation.

    Frames in gaps and past the last committed step show the kinematic fit, with status `FALLBACK`,
    `frame_step` -1, velocities by finite differences and no forces; without any window, that is all but the
    first. Quaternions are those of the simulation, whatever their sign.

    Args:
        problem: what the engine worked on.
        fit: kinematic fit, on the problem's frames.
        windows: solved windows in order; may be fewer than the clip has, with gaps between them, or none.
        times_s: (T,) of the evidence.
        grid: (T,) the problem's frame that shows each of them, not decreasing.

    Returns:
        The motion, and the audit of its replay.
    """
    model = problem.model
    parts = tuple(primitive.name for primitive in fit.body.primitives)
    state0, ctrl = _control(problem, windows)
    gaps = _gaps(windows)
    begins = np.array([begin for _, begin, _ in gaps], dtype=np.int64)
    trace = replay(model, state0, ctrl, parts, gaps)
    steps = grid * problem.clock.stride
    between = [(steps > last) & (steps < begin) for last, begin, _ in gaps]
    simulated = (steps <= len(ctrl)) & ~np.any([np.zeros(len(steps), bool), *between], axis=0)  # (T,)
    qpos, qvel = _configurations(problem, trace, grid, simulated)
    points, com, lowest = geometry(problem, parts, qpos)
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
        restart_step=begins if gaps else None,
        restart_state=np.stack([state for _, _, state in gaps]) if gaps else None,
        **_loads(trace, steps, simulated, begins),
    )
    return motion, _audit(trace, windows, lowest[simulated])


def _control(problem: Problem, windows: tuple[WindowResult, ...]) -> tuple[Array, Array]:
    """Initial state (nstate,) and control (N, nu)."""
    ctrl = schedule.stitch(windows) if windows else np.empty((0, problem.model.nu))
    if windows and not windows[0].window.start_step:
        return windows[0].states[0], ctrl
    return initial_state(problem.model, problem.qpos[0], problem.qvel0), ctrl


def _gaps(windows: tuple[WindowResult, ...]) -> Gaps:
    """Between the windows, and before the first one if it does not begin the clip."""
    ends = [0, *(result.window.start_step + len(result.ctrl) for result in windows)]
    return tuple(
        (end, result.window.start_step, result.states[0])
        for end, result in zip(ends, windows, strict=False)
        if result.window.start_step > end
    )


def _configurations(problem: Problem, trace: Trace, grid: IntArray, simulated: Mask) -> tuple[Array, Array]:
    """`qpos` (T, nq) and `qvel` (T, nv): of the simulation where there is one, else of the kinematic fit."""
    model = problem.model
    states = trace.states[(grid * problem.clock.stride)[simulated]]  # (S, nstate)
    qpos, qvel = problem.qpos[grid], differentiate(model, problem.qpos, problem.clock.frame_s)[grid]
    qpos[simulated], qvel[simulated] = qpos_of(model, states), qvel_of(model, states)
    return qpos, qvel


def _loads(trace: Trace, steps: IntArray, simulated: Mask, begins: IntArray) -> dict[str, Array]:
    """Torques and contacts at T frames, as fields of `Motion`: means since the frame before."""

    def mean(rows: Array) -> Array:
        """Mean of rows (N + 1, ...), (T, ...); zero in frames that are not simulated."""
        values = np.zeros((len(steps), *rows.shape[1:]))
        values[simulated] = mean_since(rows, steps[simulated], begins)
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
    mean_mm, max_mm = depth_mm(lowest_m)
    return Audit(
        max_root_actuator_force_N=trace.root_force_N,
        max_applied_force_N=trace.applied_force_N,
        replay_exact=_exact(trace.states, windows),
        self_penetration_max_mm=1e3 * trace.self_depth_m,
        floor_penetration_mean_mm=mean_mm,
        floor_penetration_max_mm=max_mm,
    )


def depth_mm(lowest_m: Array) -> tuple[float, float]:
    """Mean and largest depth under the ground, mm, of heights (S,) of the lowest point."""
    depths = 1e3 * np.maximum(0.0, -lowest_m)
    return float(depths.mean()), float(depths.max())


def geometry(problem: Problem, parts: tuple[str, ...], qpos: Array) -> tuple[Array, Array, Array]:
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
    starts = (result.window.start_step for result in windows)
    return all(
        np.array_equal(states[start : start + len(result.ctrl) + 1], result.states)
        for start, result in zip(starts, windows, strict=True)
    )
