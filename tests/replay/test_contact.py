"""Forces, centre of pressure and slip of a person on things, in the recorded result."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import kinematics, planners, prior, replay, schedule
from simrecon import plan as plans
from simrecon import scene as scenes
from simrecon.engines import problem as problems
from simrecon.engines import warm_start as starts
from simrecon.engines.problem import Problem
from simrecon.errors import InputError
from simrecon.geometry import rotations
from simrecon.sim import rollout
from simrecon.sim.address import Address, locate
from simrecon.sim.state import component, initial_state, simulate
from simrecon.types import Array, Body, Evidence, KinematicFit, Motion, Scene, Window
from tests.support.window_results import solved

GRAVITY, SOLE_M = 9.81, 0.02
SEAT_M = 0.45


@pytest.fixture(scope="module")
def person() -> Body:
    return bodies.build(bodies.scaled({}, 1.75), height_m=1.75, mass_kg=70.0, sole_m=SOLE_M)


def posed(person: Body, bend_rad: dict[str, float], root_m: Array) -> Array:
    """A configuration (nq,) of the person: flexed joints by name without side, upright pelvis."""
    names = person.skeleton.names[1:]
    turns = np.zeros((len(names), 3))
    for row, name in enumerate(names):
        turns[row, 1] = bend_rad.get(name.split("_")[-1], 0.0)
    relaxed = prior.gaussian(person.skeleton).mean_rad
    arms = [i for i, name in enumerate(names) if name.endswith(("shoulder", "elbow", "wrist"))]
    joints = rotations.multiply(rotations.conjugate(person.skeleton.rest[1:]), rotations.exp(turns))
    joints[arms] = rotations.exp(relaxed[arms])
    return np.concatenate((root_m, [1.0, 0.0, 0.0, 0.0], joints.ravel()))


def clip(person: Body, scene: Scene, qpos: Array, frames: int = 46, timestep_s: float = 0.01) -> Problem:
    """A problem whose motion is one pose, held."""
    times = np.arange(frames) / 30
    still = np.tile(qpos, (frames, 1))
    com, _ = kinematics.configurations(person, still)
    fit = KinematicFit(
        body=person,
        scene=scene,
        camera=None,
        times_s=times,
        qpos=still,
        com_m=com,
        reprojection_px=np.zeros((frames, 0)),
        interpolated=np.zeros(frames, bool),
        iterations=0,
        loss={},
    )
    unseen: dict[str, Any] = {"keypoint_names": (), "keypoints_px": np.zeros((frames, 0, 2))}
    evidence = Evidence(times, **unseen, scores=np.zeros((frames, 0)), joint_names=(), **_no_joints(frames))
    clock = schedule.clock(times, timestep_s)
    plan = plans.read("quick")
    return problems.pose(fit, planners.plan("none", fit, evidence, plan), evidence, clock, plan)


def _no_joints(frames: int) -> dict[str, Any]:
    return {"joints_m": np.zeros((frames, 0, 3)), "joints_frame": "world"}


def held(problem: Problem, person: Body, scene: Scene, qvel: Array | None = None) -> Motion:
    """The motion under control targets that stay at the pose."""
    qvel = np.zeros(problem.model.nv) if qvel is None else qvel
    state = initial_state(problem.model, problem.qpos[0], qvel)
    steps = problem.clock.steps
    ctrl = problem.targets_rad[:steps]
    states = simulate(problem.model, state, ctrl)
    window = solved(Window(0, 0, steps, steps), ctrl, states)
    frames = problem.clock.frames
    fit = KinematicFit(
        body=person,
        scene=scene,
        camera=None,
        times_s=np.arange(frames) / 30,
        qpos=problem.qpos[:, : locate(problem.model).nq],
        com_m=problem.com_m,
        reprojection_px=np.zeros((frames, 0)),
        interpolated=np.zeros(frames, bool),
        iterations=0,
        loss={},
    )
    motion, audit = replay.record(problem, fit, (window,), fit.times_s, np.arange(frames))
    assert audit.replay_exact
    return motion


def standing(person: Body, height_m: float = 0.0) -> Array:
    qpos = posed(person, {}, np.zeros(3))
    marks = kinematics.configurations(person, qpos[None])[1][0]
    names = person.skeleton.point_names
    sole = np.mean([marks[names.index(f"left_{end}"), 2] for end in ("heel", "toe")])
    qpos[2] = SOLE_M - sole + height_m
    return qpos


def sitting(person: Body) -> Array:
    """Thighs level, shanks upright, feet below the knees, buttocks on a seat."""
    qpos = posed(person, {"hip": -np.pi / 2, "knee": np.pi / 2}, np.zeros(3))
    model = mujoco.MjModel.from_xml_string(person.mjcf)
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    foot = model.geom("left_foot").id
    qpos[2] = -(data.geom_xpos[foot, 2] - model.geom_size[foot, 2])
    return qpos


def seat_under(person: Body, qpos: Array) -> Scene:
    """A bench that reaches from behind the pelvis to under the thighs, just below them."""
    model = mujoco.MjModel.from_xml_string(person.mjcf)
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    parts = [model.geom(name).id for name in ("left_buttock", "right_buttock")]
    low = min(
        data.geom_xpos[g, 2] - model.geom_size[g, 0] - model.geom_size[g, 1] * abs(data.geom_xmat[g, 8])
        for g in parts
    )
    table = {"name": "bench", "kind": "chair", "position_m": [0.0, 0.0, 0.0], "back": False}
    return Scene(items=(scenes.item(table | {"seat_height_m": round(float(low), 4)}, "test:"),))


SPRUNG = "[ground]\nstiffness_Npm = 3e4\ndamping_Nspm = 1500.0\n"
MAT = '[[item]]\nname = "mat"\nkind = "mat"\nposition_m = [0, 0, 0]\nheight_m = 0.1\n'


@pytest.mark.parametrize("text", ["", SPRUNG, MAT], ids=["hard", "sprung", "mat"])
def test_standing_forces_are_the_weight(person: Body, text: str) -> None:
    scene = scenes.parse(text)
    qpos = standing(person, 0.1 if text == MAT else 0.0)
    motion = held(clip(person, scene, qpos), person, scene)
    late = motion.times_s > 0.8
    assert motion.grf_N[late, 2].mean() == pytest.approx(70 * GRAVITY, rel=0.01)
    feet = [motion.contact_body.index(f"{side}_foot") for side in ("left", "right")]
    np.testing.assert_allclose(
        motion.contact_force_N[late][:, feet].sum(axis=1), motion.grf_N[late], atol=1e-6
    )
    assert (motion.contact_force_N[late][:, feet, 2] > 100).all()
    if text == SPRUNG:
        assert motion.qpos[-1, 71] == pytest.approx(-70 * GRAVITY / 3e4, rel=0.02)


def test_sitting_forces_of_seat_and_feet_are_the_weight(person: Body) -> None:
    qpos = sitting(person)
    scene = seat_under(person, qpos)
    motion = held(clip(person, scene, qpos), person, scene)
    late = motion.times_s > 0.8
    force = motion.contact_force_N[late].mean(axis=0)  # (C, 3)
    by_part = dict(zip(motion.contact_body, force[:, 2], strict=True))
    feet = by_part["left_foot"] + by_part["right_foot"]
    seat = sum(by_part.values()) - feet
    assert seat + feet == pytest.approx(70 * GRAVITY, rel=0.01)
    assert seat > 0.6 * 70 * GRAVITY
    assert feet > 0


def test_slip_is_the_speed_over_the_floor(person: Body) -> None:
    """With next to no friction all of the person slides at a metre per second.

    With none, MuJoCo's solver now and then stops short of its minimum, 0.9 rad/s off in one step.
    """
    scene = scenes.parse("[ground]\nfriction = 0.01\n")
    problem = clip(person, scene, standing(person), frames=7)
    push = np.zeros(problem.model.nv)
    push[0] = 1.0
    motion = held(problem, person, scene, push)
    feet = [motion.contact_body.index(f"{side}_foot") for side in ("left", "right")]
    # then the trunk, which stays behind, swings
    np.testing.assert_allclose(motion.contact_slip_mps[1:4, feet], 1.0, atol=0.1)
    others = np.delete(motion.contact_slip_mps, feet, axis=1)
    assert np.isnan(others).all()
    still = held(clip(person, Scene(), standing(person), frames=7), person, Scene())
    assert still.contact_slip_mps[2:, feet].max() < 0.05


def test_things_that_move_are_behind_the_person(person: Body) -> None:
    scene = scenes.parse(
        SPRUNG + '[[item]]\nname = "b"\nkind = "ball"\nposition_m = [1, 0, 0]\nmass_kg = 1\n'
    )
    problem = clip(person, scene, standing(person), frames=4)
    own = locate(problem.model)
    assert (own.body, own.nq, own.nv) == (1, 71, 54)
    assert (problem.model.nq, problem.model.nv) == (71 + 1 + 7, 54 + 1 + 6)
    np.testing.assert_allclose(problem.qpos[:, 71:], [[0, 1, 0, 0, 1, 0, 0, 0]] * 4)
    found = rollout.Simulator(problem.model, 2, 1).run(
        initial_state(problem.model, problem.qpos[0], problem.qvel0),
        np.repeat(problem.targets_rad[None, :11], 2, axis=0),
        np.array([0, 10]),
    )
    assert found.qpos.shape == (2, 2, 71)
    assert found.com_m[0, 0, 2] == pytest.approx(problem.com_m[0, 2], abs=1e-3)


def test_the_person_is_the_first_tree() -> None:
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><freejoint/><geom size='1'/></body>"
        "<body><joint type='slide'/><geom size='1'/></body></worldbody></mujoco>"
    )
    assert locate(model) == Address(1, slice(0, 7), slice(0, 6))


@pytest.fixture(scope="module")
def finished(person: Body) -> Motion:
    problem = clip(person, Scene(), standing(person), frames=10)
    swung = 0.05 * np.sin(np.arange(len(problem.targets_rad)) / 5)[:, None]
    return held(replace(problem, targets_rad=problem.targets_rad + swung), person, Scene())


def test_a_finished_motion_is_where_the_next_run_starts(person: Body, finished: Motion) -> None:
    problem, handover = starts.from_motion(clip(person, Scene(), standing(person), frames=10), finished)
    states = simulate(problem.model, handover.state, problem.targets_rad[: problem.clock.steps])
    qpos = component(problem.model, states, mujoco.mjtState.mjSTATE_QPOS)
    np.testing.assert_array_equal(qpos[finished.frame_step], finished.qpos)
    assert not len(handover.knots_rad)


def test_a_finished_motion_starts_a_run_in_another_scene_at_another_step(
    person: Body, finished: Motion
) -> None:
    scene = scenes.parse(SPRUNG)
    before = clip(person, scene, standing(person), frames=12, timestep_s=0.006)
    problem, handover = starts.from_motion(before, finished)
    covered = np.arange(len(problem.targets_rad)) * before.clock.step_s < 9 / 30 - 1e-6
    at = np.arange(len(finished.ctrl)) * (0.3 / len(finished.ctrl))
    expected = np.interp(np.flatnonzero(covered) * before.clock.step_s, at, finished.ctrl[:, 20])
    np.testing.assert_allclose(problem.targets_rad[covered, 20], expected, atol=1e-12)
    np.testing.assert_array_equal(problem.targets_rad[~covered], before.targets_rad[~covered])
    qpos = component(problem.model, handover.state, mujoco.mjtState.mjSTATE_QPOS)
    np.testing.assert_array_equal(qpos, [*finished.qpos[0], 0.0])


def test_a_motion_that_does_not_fit_is_refused(person: Body, finished: Motion) -> None:
    problem = clip(person, Scene(), standing(person), frames=10)
    with pytest.raises(InputError, match="47 motors"):
        starts.from_motion(problem, replace(finished, ctrl=finished.ctrl[:, :47]))
    with pytest.raises(InputError, match="no simulated frames"):
        starts.from_motion(problem, replace(finished, ctrl=finished.ctrl[:0]))
