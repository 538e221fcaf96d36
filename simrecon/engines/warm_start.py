"""Where the optimisation of a clip begins when a finished motion is at hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon.engines.problem import Problem
from simrecon.errors import InputError
from simrecon.sim.address import locate
from simrecon.sim.state import initial_state
from simrecon.types import Handover, Motion


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
    clock, model = problem.clock, problem.model
    person = locate(model)
    steps = motion.frame_step[motion.frame_step >= 0]
    if not len(steps) or not len(motion.ctrl) or steps.max() == 0:
        raise InputError("the motion to start from has no simulated frames")
    if motion.ctrl.shape[1] != model.nu or motion.qpos.shape[1] < person.nq:
        raise InputError(
            f"the motion to start from has {motion.ctrl.shape[1]} motors and {motion.qpos.shape[1]} "
            f"coordinates; valid: those of this body, {model.nu} and {person.nq} or more"
        )
    last = int(np.flatnonzero(motion.frame_step == steps.max())[0])
    step_s = float(motion.times_s[last] - motion.times_s[0]) / int(steps.max())
    covered_s = step_s * len(motion.ctrl)
    targets = problem.targets_rad.copy()  # (N + 1, nu)
    times_s = clock.step_s * np.arange(len(targets))
    known = times_s < covered_s - 1e-6
    if abs(step_s / clock.step_s - 1) < 1e-6:
        count = int(known.sum())
        targets[:count] = motion.ctrl[:count]
    else:
        before_s = step_s * np.arange(len(motion.ctrl))
        for column, values in zip(targets.T, motion.ctrl.T, strict=True):
            column[known] = np.interp(times_s[known], before_s, values)
    if known.all() or times_s[-1] <= covered_s + 1e-6:
        targets[~known] = targets[int(known.sum()) - 1]
    qpos, qvel = problem.qpos[0].copy(), np.zeros(model.nv)
    qpos[: person.nq], qvel[: person.nv] = motion.qpos[0, : person.nq], motion.qvel[0, : person.nv]
    state = initial_state(model, qpos, qvel)
    return replace(problem, targets_rad=targets), Handover(state, np.zeros((0, model.nu)))
