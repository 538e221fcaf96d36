"""What bodies feel in rollouts, against the plain loop that reads every contact."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon import schedule
from simrecon.engines import warm_start
from simrecon.engines.problem import FEET, Problem
from simrecon.replay.trace import replay
from simrecon.sim.felt import Felt, means
from simrecon.sim.rollout import Simulator
from tests.engines.conftest import Makers

PARTS = ("left_foot", "right_foot")


@pytest.fixture(scope="module")
def problem() -> Problem:
    return Makers.clip(Makers.settings(population=2, landmark=1.0), Makers.standing(frames=9))


def test_sensors_say_what_the_replay_reads_and_change_no_bit(problem: Problem) -> None:
    (window, *_), handover = schedule.cut(problem.clock, problem.plan), warm_start.from_fit(problem)
    steps = window.end_step - window.start_step
    ctrl = problem.targets_rad[None, : steps + 1]
    at_steps = np.array([0, 2, steps - 1])
    felt = Felt.of(problem.mjcf, FEET)
    rolled = Simulator(problem.model, 2, 1, felt).run(handover.state, ctrl, at_steps)
    plain = Simulator(problem.model, 2, 1).run(handover.state, ctrl, at_steps)
    np.testing.assert_array_equal(rolled.qpos, plain.qpos)
    assert plain.wrenches.shape == (1, 3, 0, 6)
    trace = replay(problem.model, handover.state, ctrl[0, :-1], PARTS)
    rows = np.concatenate((trace.couple_Nm, trace.force_N), axis=-1)  # (N + 1, 2, 6)
    expected = np.stack((0 * rows[0], rows[1:3].mean(axis=0), rows[3:steps].mean(axis=0)))
    assert np.abs(expected[1:, :, 5]).max() > 100.0
    np.testing.assert_allclose(rolled.wrenches[0], expected, rtol=0, atol=1e-6)


def test_means_are_over_the_steps_between() -> None:
    wrenches = np.arange(7.0)[None, :, None, None] * np.ones((1, 7, 1, 6))
    found = means(wrenches, np.array([0, 1, 4, 6]))
    np.testing.assert_allclose(found[0, :, 0, 0], [0.0, 0.0, 2.0, 4.5])
