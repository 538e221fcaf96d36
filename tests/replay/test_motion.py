"""The final replay: bits, forces, frames that were not simulated, and the audit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
import pytest

from simrecon import replay
from simrecon import scene as scenes
from simrecon.geometry import rotations
from simrecon.sim.state import forward, initial_state, simulate
from simrecon.types import Array, IntArray, Motion, Scene, SceneItem

GRAVITY = 9.81


def recorded(held: Any, windows: Any = None, grid: IntArray | None = None) -> tuple[Motion, replay.Audit]:
    grid = np.arange(held.problem.clock.frames) if grid is None else grid
    windows = held.windows if windows is None else windows
    return replay.record(held.problem, held.fit, windows, held.evidence.times_s[grid], grid)


def states(held: Any, steps: int) -> Array:
    """Plain replay of the first steps."""
    ctrl = np.concatenate([window.ctrl for window in held.windows])[:steps]
    return simulate(held.problem.model, held.windows[0].states[0], ctrl)


def test_every_frame_is_a_state_of_the_simulation(standing: Any) -> None:
    motion, audit = recorded(standing)
    nq, nv = standing.problem.model.nq, standing.problem.model.nv
    read = states(standing, len(motion.ctrl))[motion.frame_step]  # state: time, qpos, qvel, ...
    assert (motion.qpos == read[:, 1 : 1 + nq]).all()
    assert (motion.qvel == read[:, 1 + nq : 1 + nq + nv]).all()
    assert (motion.frame_step == standing.problem.clock.stride * np.arange(31)).all()
    assert (motion.status == replay.SIMULATED).all()
    assert audit.replay_exact
    assert audit.max_root_actuator_force_N == 0.0
    assert audit.max_applied_force_N == 0.0


def test_audit_sees_states_that_are_off_by_one_bit(standing: Any) -> None:
    first, second = standing.windows
    wrong = second.states.copy()
    wrong[-1, 1] = np.nextafter(wrong[-1, 1], np.inf)
    _, audit = recorded(standing, (first, replace(second, states=wrong)))
    assert not audit.replay_exact


def test_standing_weighs_the_body_weight(standing: Any) -> None:
    motion, _ = recorded(standing)
    weight = standing.fit.body.mass_kg * GRAVITY
    late = motion.grf_N[15:]
    assert np.allclose(late[:, 2], weight, rtol=0.02)
    assert np.abs(late[:, :2]).max() < 0.02 * weight
    loaded = {motion.contact_body[i] for i in np.flatnonzero(motion.contact_force_N.any(axis=(0, 2)))}
    assert loaded == {"left_foot", "right_foot"}
    feet = [motion.contact_body.index(f"{side}_foot") for side in ("left", "right")]
    (left, right), (left_m, right_m) = (
        np.moveaxis(values[15:, feet], 1, 0)
        for values in (motion.contact_force_N[..., 2], motion.contact_point_m[..., 1])
    )
    # by the lever about the right foot, wherever the centre of mass is between them
    share = (motion.com_m[15:, 1] - right_m) / (left_m - right_m)
    assert np.allclose(left, share * weight, rtol=0.05)
    assert np.allclose(right, (1.0 - share) * weight, rtol=0.05)


def test_contact_forces_move_the_centre_of_mass(standing: Any) -> None:
    """Newton: the change of momentum over the clip is the impulse of contact and gravity."""
    motion, _ = recorded(standing)
    mass, interval = standing.fit.body.mass_kg, standing.problem.clock.frame_s
    velocity = np.array(
        [com_velocity(standing, *pair) for pair in zip(motion.qpos, motion.qvel, strict=True)]
    )
    change = mass * (velocity[-1] - velocity[0])
    impulse = interval * (motion.grf_N[1:] - [0, 0, mass * GRAVITY]).sum(axis=0)
    assert np.allclose(change, impulse, atol=0.02 * mass * GRAVITY * interval)


def com_velocity(held: Any, qpos: Array, qvel: Array) -> Array:
    data = forward(held.problem.model, initial_state(held.problem.model, qpos, qvel))
    mujoco.mj_subtreeVel(held.problem.model, data)
    return data.subtree_linvel[1].copy()


def test_centre_of_pressure_lies_under_the_sole(standing: Any) -> None:
    motion, _ = recorded(standing)
    foot = motion.contact_body.index("left_foot")
    heel, toe = (motion.joints_m[:, motion.joint_names.index(f"left_{end}")] for end in ("heel", "toe"))
    point = motion.contact_point_m[15:, foot]
    assert (point[:, 0] > heel[15:, 0] - 0.03).all()
    assert (point[:, 0] < toe[15:, 0] + 0.06).all()
    assert np.abs(point[:, 1] - heel[15:, 1]).max() < 0.05
    assert np.abs(point[:, 2]).max() < 0.005
    without = motion.contact_force_N == 0
    assert (np.isnan(motion.contact_point_m) == without.all(axis=-1, keepdims=True)).all()


def test_forces_are_means_since_the_frame_before(standing: Any) -> None:
    every, _ = recorded(standing)
    sparse, _ = recorded(standing, grid=np.array([0, 4, 4, 10, 30]))
    assert np.allclose(sparse.grf_N[1], every.grf_N[1:5].mean(axis=0))
    assert np.allclose(sparse.torque_Nm[3], every.torque_Nm[5:11].mean(axis=0))
    assert (sparse.grf_N[2] == sparse.grf_N[1]).all()
    assert (sparse.qpos == every.qpos[[0, 4, 4, 10, 30]]).all()


def test_first_frame_shows_the_forces_of_the_initial_state(standing: Any) -> None:
    motion, _ = recorded(standing)
    data = forward(standing.problem.model, motion.state0)
    assert (motion.torque_Nm[0] == data.actuator_force).all()
    assert data.ncon > 0
    total = np.zeros(3)
    for contact in range(data.ncon):
        wrench = np.empty(6)
        mujoco.mj_contactForce(standing.problem.model, data, contact, wrench)
        total += data.contact.frame[contact].reshape(3, 3).T @ wrench[:3]
    assert np.allclose(motion.grf_N[0], total)


def test_points_and_centre_of_mass_are_those_of_the_frame(standing: Any) -> None:
    motion, _ = recorded(standing)
    model = standing.problem.model
    data = forward(model, initial_state(model, motion.qpos[20], motion.qvel[20]))
    for name in ("pelvis", "left_knee", "right_wrist", "head"):
        where = data.site(name).xpos
        assert np.allclose(motion.joints_m[20, motion.joint_names.index(name)], where, atol=1e-12)
    assert np.allclose(motion.com_m[20], data.subtree_com[1], atol=1e-12)
    needed = {"pelvis", "neck", "head"} | {
        f"{side}_{joint}"
        for side in ("left", "right")
        for joint in ("hip", "knee", "ankle", "heel", "toe", "shoulder", "elbow", "wrist")
    }
    assert needed <= set(motion.joint_names)


def test_frames_past_the_last_window_are_marked_and_kinematic(standing: Any) -> None:
    motion, audit = recorded(standing, standing.windows[:1])
    reached = 15
    assert (motion.status == (np.arange(31) > reached)).all()
    assert (motion.frame_step[reached + 1 :] == -1).all()
    assert (motion.qpos[reached + 1 :] == standing.fit.qpos[reached + 1 :]).all()
    assert np.allclose(motion.qvel[reached + 1 :], 0.0)
    assert not motion.grf_N[reached + 1 :].any()
    assert not motion.torque_Nm[reached + 1 :].any()
    assert np.isnan(motion.contact_point_m[reached + 1 :]).all()
    assert motion.grf_N[: reached + 1, 2].min() > 0
    assert audit.replay_exact


def test_without_any_window_only_the_first_frame_is_simulated(standing: Any) -> None:
    motion, audit = recorded(standing, ())
    assert motion.status.tolist() == [0] + [1] * 30
    assert motion.ctrl.shape == (0, standing.problem.model.nu)
    assert (motion.qpos == standing.fit.qpos).all()
    assert (motion.state0[1 : 1 + standing.problem.model.nq] == standing.fit.qpos[0]).all()
    assert audit.replay_exact


def test_forces_of_all_things_of_the_scene_act_on_the_body(standing: Any) -> None:
    """On two blocks that together carry the person, one under each foot, and on a floor beneath."""
    blocks = tuple(
        SceneItem(name, "box", (0.0, y, -0.2), {"size_m": (1.0, 0.3, 0.2)})
        for name, y in (("a", 0.15), ("b", -0.15))
    )
    scene = Scene(replace(standing.fit.scene.ground, height_m=-0.2), blocks)
    mjcf = scenes.build(standing.fit.body.mjcf, scene, standing.problem.clock.step_s)
    problem = replace(standing.problem, mjcf=mjcf, model=mujoco.MjModel.from_xml_string(mjcf))
    ctrl = problem.targets_rad[: problem.clock.steps]
    first = initial_state(problem.model, problem.qpos[0], problem.qvel0)
    walked = simulate(problem.model, first, ctrl)
    window = replace(standing.windows[0], ctrl=ctrl, states=walked)
    grid = np.arange(31)
    fit = replace(standing.fit, scene=scene)
    motion, audit = replay.record(problem, fit, (window,), standing.evidence.times_s, grid)
    assert np.allclose(motion.grf_N[15:, 2], fit.body.mass_kg * GRAVITY, rtol=0.02)
    assert audit.floor_penetration_max_mm == 0.0


def test_self_contact_is_no_force_of_the_scene(standing: Any) -> None:
    """In the air, with the legs pressed together, only the audit notices."""
    problem = standing.problem
    model, qpos = problem.model, problem.qpos[0].copy()
    qpos[2] += 1.0
    for name, angle in (("left_hip", -0.1), ("right_hip", 0.1)):
        joint = slice(model.joint(name).qposadr[0], model.joint(name).qposadr[0] + 4)
        qpos[joint] = rotations.multiply(qpos[joint], rotations.exp([angle, 0.0, 0.0]))
    state, ctrl = initial_state(model, qpos, np.zeros(model.nv)), problem.targets_rad[:1]
    touching = forward(model, state)
    window = replace(standing.windows[0], ctrl=ctrl, states=simulate(model, state, ctrl))
    motion, audit = recorded(standing, (window,))
    assert audit.self_penetration_max_mm == pytest.approx(-1e3 * touching.contact.dist.min())
    assert audit.self_penetration_max_mm is not None
    assert audit.self_penetration_max_mm > 1
    assert not motion.grf_N.any()


def test_penetration_is_measured_at_the_frames(standing: Any) -> None:
    model = standing.problem.model
    sunk = standing.problem.qpos.copy()
    sunk[:, 2] -= 0.03
    problem = replace(standing.problem, qpos=sunk)
    motion, audit = replay.record(problem, standing.fit, (), standing.evidence.times_s, np.arange(31))
    data = mujoco.MjData(model)
    data.qpos[:] = motion.qpos[0]
    mujoco.mj_kinematics(model, data)
    corners = [
        data.geom(f"{side}_foot").xpos[2]
        - np.abs(data.geom(f"{side}_foot").xmat.reshape(3, 3)[2]) @ model.geom(f"{side}_foot").size
        for side in ("left", "right")
    ]
    assert audit.floor_penetration_mean_mm == pytest.approx(-1e3 * min(corners), abs=1e-6)
    assert audit.floor_penetration_max_mm == pytest.approx(audit.floor_penetration_mean_mm)
