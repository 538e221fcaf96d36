"""Where the optimisation of a clip begins: at the kinematic pose, or at a finished motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from simrecon.engines.problem import Problem
from simrecon.errors import InputError
from simrecon.sim.address import locate
from simrecon.sim.state import initial_state
from simrecon.types import Array, Handover, Motion


def begin(problem: Problem, motion: Motion | None) -> tuple[Problem, Handover]:
    """Begin at the kinematic fit, or at a finished motion if there is one; see `from_motion`."""
    return (problem, from_fit(problem)) if motion is None else from_motion(problem, motion)


def check_beginning(motion: Motion | None, frame_s: float, times_s: Array) -> None:
    """Check that a motion to start from begins where the clip does; its frames are at times (T,).

    Raises:
        InputError: it does not.
    """
    if motion is not None and abs(motion.times_s[0] - times_s[0]) > 0.5 * frame_s:
        found, valid = f"{motion.times_s[0]:.6g} s", f"one that begins with the clip, at {times_s[0]:.6g} s"
        raise InputError(f"the motion to start from: found one that begins at {found}; valid: {valid}")


def from_fit(problem: Problem) -> Handover:
    """Begin at the kinematic pose of the first frame and its velocity, with no knots yet."""
    return _without_knots(problem, problem.qpos[0], problem.qvel0)


def from_motion(problem: Problem, motion: Motion) -> tuple[Problem, Handover]:
    """Begin at a finished motion: its control replaces the kinematic targets, its state is the first.

    All knots are zero there, so the optimiser of every window starts from the control that was found before;
    where the scene and the time step are the same, that replays the motion. Steps that the motion lacks keep
    their kinematic targets.

    Args:
        problem: of the clip, perhaps in another scene.
        motion: of the same clip, simulated at least in its first frames.

    Raises:
        InputError: it was not simulated, or is of another body or clip.
    """
    model = problem.model
    person = locate(model)
    steps = motion.frame_step[motion.frame_step >= 0]
    if not len(steps) or not len(motion.ctrl) or steps.max() == 0:
        raise InputError("the motion to start from has no simulated frames")
    if motion.ctrl.shape[1] != model.nu or motion.qpos.shape[1] < person.nq:
        raise InputError(
            f"the motion to start from has {motion.ctrl.shape[1]} motors and {motion.qpos.shape[1]} "
            f"coordinates; valid: those of this body, {model.nu} and {person.nq} or more"
        )
    qpos, qvel = problem.qpos[0].copy(), np.zeros(model.nv)
    qpos[person.qpos], qvel[person.qvel] = motion.qpos[0, : person.nq], motion.qvel[0, : person.nv]
    return replace(problem, targets_rad=_targets(problem, motion)), _without_knots(problem, qpos, qvel)


def _targets(problem: Problem, motion: Motion) -> Array:
    """Control targets (N + 1, nu): the motion's control on the problem's steps, as far as it goes."""
    step_s, last_step = problem.clock.step_s, int(motion.frame_step.max())
    last = int(np.flatnonzero(motion.frame_step == last_step)[0])
    own_step_s = float(motion.times_s[last] - motion.times_s[0]) / last_step
    covered_s = own_step_s * len(motion.ctrl)
    targets = problem.targets_rad.copy()  # (N + 1, nu)
    times_s = step_s * np.arange(len(targets))
    known = times_s < covered_s - 1e-6
    if abs(own_step_s / step_s - 1) < 1e-6:
        count = int(known.sum())
        targets[:count] = motion.ctrl[:count]
    else:
        own_times_s = own_step_s * np.arange(len(motion.ctrl))
        for column, values in zip(targets.T, motion.ctrl.T, strict=True):
            column[known] = np.interp(times_s[known], own_times_s, values)
    if known.all() or times_s[-1] <= covered_s + 1e-6:
        targets[~known] = targets[int(known.sum()) - 1]
    gap = _in_gaps(motion, np.asarray(times_s / own_step_s, np.float64))
    targets[gap] = problem.targets_rad[gap]
    return targets


def _in_gaps(motion: Motion, steps: Array) -> NDArray[np.bool_]:
    """Which of the motion's own steps (S,) have no control, for they lie in a gap of its simulation."""
    inside = np.zeros(len(steps), bool)
    for begin in () if motion.restart_step is None else motion.restart_step:
        before = motion.frame_step[(motion.frame_step >= 0) & (motion.frame_step < begin)]
        inside |= (steps > before.max(initial=0) - 1e-6) & (steps < begin - 1e-6)
    return inside


def _without_knots(problem: Problem, qpos: Array, qvel: Array) -> Handover:
    """What a first window takes over that starts at qpos (nq,) and qvel (nv,)."""
    return Handover(initial_state(problem.model, qpos, qvel), np.zeros((0, problem.model.nu)))
