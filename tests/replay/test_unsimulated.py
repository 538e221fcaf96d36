"""The motion of a plan: its poses and forces as they are, and nothing that only a simulation has."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from simrecon import replay
from simrecon.engines import feedforward
from simrecon.types import Motion, Reference

GRID = np.arange(0, 31, 2)


def reference(held: Any, **more: Any) -> Reference:
    return Reference("none", held.fit.times_s, held.fit.qpos, held.fit.com_m, **more)


def borne(held: Any) -> Reference:
    """Two points of the left foot and one of the right bear the weight; a hand almost nothing."""
    frames, weight = len(held.fit.times_s), held.fit.body.mass_kg * 9.81
    force, place = np.zeros((frames, 4, 3)), np.zeros((frames, 4, 3))
    force[:, :, 2] = np.array([0.2 * weight, 0.3 * weight, 0.5 * weight - 0.5, 0.5])
    place[:, :3, 1] = 0.1, 0.1, -0.1
    place[:, 0, 0], place[:, 1, 0] = 0.1, -0.1
    return reference(
        held,
        contact_segments=("left_ankle", "left_ankle", "right_ankle", "left_wrist"),
        contact_parts=("left_foot", "left_foot", "right_foot", "left_hand"),
        contact_force_N=force,
        contact_place_m=place,
    )


def planned(held: Any, plan: Reference) -> tuple[Motion, replay.Audit]:
    return replay.plan(held.problem, held.fit, plan, held.fit.times_s[GRID], GRID)


def test_poses_are_those_of_the_plan_and_nothing_claims_a_simulation(standing: Any) -> None:
    motion, audit = planned(standing, reference(standing))
    assert (motion.qpos == standing.problem.qpos[GRID]).all()
    assert (motion.status == replay.PLANNED).all()
    assert (motion.frame_step == replay.NO_STEP).all()
    assert motion.ctrl.shape == (0, standing.problem.model.nu)
    assert motion.is_planned
    assert motion.kept.all()
    assert not motion.begins.any()
    assert audit.replay_exact is None
    assert audit.max_root_actuator_force_N is None
    assert audit.max_applied_force_N is None
    assert audit.self_penetration_max_mm is None
    assert audit.floor_penetration_max_mm == pytest.approx(0, abs=0.1)


def test_without_forces_there_are_no_torques_either(standing: Any) -> None:
    motion, _ = planned(standing, reference(standing))
    assert not motion.knows_forces
    assert not motion.torque_Nm.any()
    assert not motion.grf_N.any()
    assert np.isnan(motion.contact_point_m).all()


def test_forces_are_summed_by_primitive_and_lie_between_their_points(standing: Any) -> None:
    motion, _ = planned(standing, borne(standing))
    weight = standing.fit.body.mass_kg * 9.81
    left, hand = (motion.contact_body.index(name) for name in ("left_foot", "left_hand"))
    assert motion.knows_forces
    np.testing.assert_allclose(motion.contact_force_N[:, left, 2], 0.5 * weight)
    np.testing.assert_allclose(
        motion.contact_point_m[:, left], np.tile([-0.02, 0.1, 0.0], (len(GRID), 1)), atol=1e-9
    )
    np.testing.assert_allclose(motion.grf_N[:, 2], weight)
    assert np.isnan(motion.contact_point_m[:, hand]).all()
    assert np.isnan(motion.contact_slip_mps).all()


def test_torques_are_those_that_the_motion_takes_whatever_the_motors_can_do(standing: Any) -> None:
    plan = borne(standing)
    assert plan.contact_force_N is not None
    plan = replace(plan, contact_force_N=200 * plan.contact_force_N)
    motion, _ = planned(standing, plan)
    needed = feedforward.needed(standing.problem.model, standing.problem.qpos, plan)
    within = feedforward.torques(standing.problem.model, standing.problem.qpos, plan)
    assert needed is not None
    assert within is not None
    np.testing.assert_array_equal(motion.torque_Nm, needed[GRID])
    assert np.abs(motion.torque_Nm).max() > np.abs(within).max() + 1


def test_velocities_are_finite_differences(standing: Any) -> None:
    qpos = standing.problem.qpos.copy()
    qpos[:, 0] += 0.3 * standing.fit.times_s
    moving = replace(standing, problem=replace(standing.problem, qpos=qpos))
    motion, _ = planned(moving, reference(moving))
    np.testing.assert_allclose(motion.qvel[:, 0], 0.3, atol=1e-6)
    np.testing.assert_allclose(motion.qvel[:, 6:], 0, atol=1e-6)
    assert motion.planned_qpos is not None
