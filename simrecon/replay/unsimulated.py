"""The motion of a plan, where nothing is simulated."""

from __future__ import annotations

import numpy as np

from simrecon.engines import feedforward
from simrecon.engines.problem import Problem
from simrecon.replay.planned import loads
from simrecon.replay.recording import Audit, depth_mm, geometry
from simrecon.sim.address import with_items_at_rest
from simrecon.sim.poses import differentiate
from simrecon.sim.state import initial_state
from simrecon.types import Array, IntArray, KinematicFit, Motion, Reference
from simrecon.types.motion import NO_STEP, PLANNED


def plan(
    problem: Problem, fit: KinematicFit, reference: Reference, times_s: Array, grid: IntArray
) -> tuple[Motion, Audit]:
    """The planned poses as a motion, with status `PLANNED`, `frame_step` -1 and no control.

    Velocities are finite differences. The force on each primitive is the sum of those that the plan has on it
    in the frame, and torques are those that the motion takes under them, whatever the motors can do; both are
    zero where the planner knows no forces. What slips is not known.

    Args:
        problem: with the planned poses.
        fit: kinematic fit, on the problem's frames.
        reference: the plan, on the same frames.
        times_s: (T,) of the evidence.
        grid: (T,) the problem's frame that shows each of them, not decreasing.

    Returns:
        The motion, and what can be measured of it without a replay.
    """
    model, parts = problem.model, tuple(primitive.name for primitive in fit.body.primitives)
    qpos = problem.qpos[grid]
    points, com, lowest = geometry(problem, parts, qpos)
    mean_mm, max_mm = depth_mm(lowest)
    force, centre = (values[grid] for values in loads(reference, parts))
    torques = feedforward.needed(model, problem.qpos, reference)
    fitted = with_items_at_rest(model, fit.qpos)
    motion = Motion(
        times_s=times_s,
        frame_step=np.full(len(grid), NO_STEP, dtype=np.int64),
        status=np.full(len(grid), PLANNED, dtype=np.uint8),
        qpos=qpos,
        qvel=differentiate(model, problem.qpos, problem.clock.frame_s)[grid],
        state0=initial_state(model, problem.qpos[0], problem.qvel0),
        ctrl=np.empty((0, model.nu)),
        joint_names=fit.body.skeleton.point_names,
        joints_m=points,
        com_m=com,
        torque_Nm=np.zeros((len(grid), model.nu)) if torques is None else torques[grid],
        contact_body=parts,
        contact_force_N=force,
        contact_point_m=centre,
        contact_slip_mps=np.full(force.shape[:2], np.nan),
        grf_N=force.sum(axis=1),
        kinematic_qpos=fitted[grid],
        planned_qpos=None if np.array_equal(fitted, problem.qpos) else qpos,
    )
    return motion, Audit(None, None, None, None, mean_mm, max_mm)
