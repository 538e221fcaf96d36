"""Joint moments and powers of a simulated motion, by inverse dynamics of what a laboratory would measure.

The motion and the forces of the scene, step by step, go through one low-pass filter; what the segments then
need beside these forces is the moment at each joint: of muscles, passive tissue and joint stops together.
What is left at the root, where nothing acts, says how well motion and forces agree. What parts of the body
do to each other is not taken out: a forearm that rests against the waist shows in elbow and shoulder.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from simrecon.errors import InputError
from simrecon.metrics import filters
from simrecon.replay.trace import ROOT_DOFS, Trace, gaps_of, replay
from simrecon.sim.address import locate
from simrecon.sim.inverse_dynamics import inverse, rates
from simrecon.sim.state import qpos_of
from simrecon.types import Array, Body, Motion

CUTOFF_HZ = 20.0
"""Of the filter where none is named: keeps a heel strike, as in comparisons of forces (docs/metrics.md)."""
STEPS_MIN = 8
"""A simulation of fewer steps has none."""


@dataclass(frozen=True, eq=False)
class Moments:
    """Moments at T frames of K joints, NaN where nothing is simulated.

    Attributes:
        cutoff_hz: of the zero-lag Butterworth filter of fourth order that motion and forces went through.
        joints: K names.
        moment_Nm: (T, K, 3) of the upper segment on the lower one, in the axes of the joint's motors.
        power_W: (T, K) moment times angular velocity; positive where the joint gives energy.
        root_force_N: (T, 3) that is left at the root, in the world; root_moment_Nm: (T, 3), in its own axes.
    """

    cutoff_hz: float
    joints: tuple[str, ...]
    moment_Nm: Array
    power_W: Array
    root_force_N: Array
    root_moment_Nm: Array


def moments(model: mujoco.MjModel, body: Body, motion: Motion, cutoff_hz: float = CUTOFF_HZ) -> Moments:
    """Of a simulated motion, at its frames.

    Args:
        model: of person and scene.
        body: the person.
        motion: which is stepped once more.
        cutoff_hz: of the filter; less where frames or steps are too far apart for it (`filters.possible_hz`).

    Raises:
        InputError: nothing was simulated.
    """
    if motion.is_planned or not len(motion.ctrl):
        raise InputError("joint moments: found a motion that was not simulated; valid: a simulated one")
    step_s, frame_s = model.opt.timestep, float(np.median(np.diff(motion.times_s)))
    cutoff_hz = filters.possible_hz(cutoff_hz, max(step_s, frame_s))
    trace = replay(model, motion.state0, motion.ctrl, motion.contact_body, gaps_of(motion))
    person, qpos = locate(model), qpos_of(model, trace.states)
    owners = {part.name: part.segment for part in body.primitives}
    bodies = np.array([model.body(person.prefix + owners[part]).id for part in motion.contact_body])
    bare = copy.copy(model)
    bare.dof_damping[:] = bare.dof_armature[:] = 0.0  # of passive tissue and motors: they are in the moments
    taken = np.full((len(motion.times_s), 2, person.nv), np.nan)  # forces and rates
    for first, last in _simulated(trace, motion):
        rows = np.arange(first, last + 1)
        if len(rows) < STEPS_MIN:
            continue
        own = qpos[rows]
        own[:, : person.nq] = filters.low_passed_poses(own[:, : person.nq], step_s, cutoff_hz)
        force, couple = (
            _at_states(part[rows], step_s, cutoff_hz) for part in (trace.force_N, trace.couple_Nm)
        )
        needed = inverse(bare, own, step_s, bodies, np.zeros_like(force), force, couple)
        speeds = rates(bare, own, step_s)
        shown = np.flatnonzero((motion.frame_step >= first) & (motion.frame_step <= last))
        at = motion.frame_step[shown] - first
        taken[shown, 0], taken[shown, 1] = needed[at, : person.nv], speeds[at, : person.nv]
    joints = taken[:, :, ROOT_DOFS:].reshape(len(taken), 2, -1, 3)  # (T, 2, K, 3)
    return Moments(
        cutoff_hz,
        body.skeleton.names[1:],
        joints[:, 0],
        (joints[:, 0] * joints[:, 1]).sum(axis=-1),
        taken[:, 0, :3],
        taken[:, 0, 3:ROOT_DOFS],
    )


def _simulated(trace: Trace, motion: Motion) -> Iterator[tuple[int, int]]:
    """First and last step of each simulation that goes on without a gap."""
    begin = 0
    for last, anew, _ in gaps_of(motion):
        yield begin, last
        begin = anew
    yield begin, len(trace.states) - 1


def _at_states(rows: Array, step_s: float, cutoff_hz: float) -> Array:
    """What acts (n, C, 3) over the step before each state, low-passed, at the states themselves."""
    slow = filters.low_pass(rows[1:], step_s, cutoff_hz)
    return np.concatenate((slow[:1], (slow[1:] + slow[:-1]) / 2, slow[-1:]))
