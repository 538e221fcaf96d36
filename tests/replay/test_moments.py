"""Joint moments by inverse dynamics: those that the motors exerted, and nothing at the root."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from simrecon.errors import InputError
from simrecon.metrics import filters
from simrecon.replay.moments import moments
from simrecon.replay.trace import replay
from simrecon.sim.address import motor_dofs
from simrecon.sim.state import qvel_of
from simrecon.types.motion import PLANNED

INNER = slice(3, -3)


def test_they_are_what_motors_and_passive_tissue_exert(run: Any) -> None:
    motion, model, body = run.motion, run.problem.model, run.fit.body
    found = moments(model, body, motion, 8.0)
    assert found.cutoff_hz == 8.0
    assert found.joints == body.skeleton.names[1:]
    trace = replay(model, motion.state0, motion.ctrl, motion.contact_body)
    dofs = motor_dofs(model)
    speeds = qvel_of(model, trace.states)[:, dofs]
    own = trace.torque_Nm - model.dof_damping[dofs] * speeds
    slow = filters.low_pass(own[1:], model.opt.timestep, 8.0)
    at = motion.frame_step[INNER]
    exerted = ((slow[at - 1] + slow[np.minimum(at, len(slow) - 1)]) / 2).reshape(len(at), -1, 3)
    off = found.moment_Nm[INNER] - exerted
    assert np.sqrt(np.mean(off**2)) < 0.05 * np.sqrt(np.mean(exerted**2))
    weight_N = 9.81 * body.mass_kg
    assert np.linalg.norm(found.root_force_N[INNER], axis=-1).mean() < 0.03 * weight_N
    assert np.linalg.norm(found.root_moment_Nm[INNER], axis=-1).mean() < 0.03 * weight_N


def test_work_of_the_joints_is_the_energy_that_they_give(run: Any) -> None:
    """Knees that bend under load take energy."""
    motion = run.motion
    found = moments(run.problem.model, run.fit.body, motion, 8.0)
    knees = [found.joints.index(f"{side}_knee") for side in ("left", "right")]
    rate = np.gradient(motion.com_m[:, 2], motion.times_s)
    down = rate < np.quantile(rate, 0.2)
    assert found.power_W[down][:, knees].mean() < 0


def test_the_cutoff_is_one_that_the_frames_allow(run: Any) -> None:
    found = moments(run.problem.model, run.fit.body, run.motion, 500.0)
    rate_hz = 1.0 / np.median(np.diff(run.motion.times_s))
    assert found.cutoff_hz == pytest.approx(0.4 * rate_hz)


def test_a_plan_has_none(run: Any) -> None:
    planned = replace(run.motion, status=np.full_like(run.motion.status, PLANNED))
    with pytest.raises(InputError, match="found a motion that was not simulated"):
        moments(run.problem.model, run.fit.body, planned)
