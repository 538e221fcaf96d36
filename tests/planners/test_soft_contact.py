"""The laws of motion in the estimate: what they are made of, and a plan of the example."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import mujoco
import numpy as np
import pytest

from simrecon import plan, planners, schedule
from simrecon import scene as scenes
from simrecon.contact import rules, wishes
from simrecon.contact.parts import names
from simrecon.engines import feedforward
from simrecon.engines import problem as problems
from simrecon.kinematics import layout
from simrecon.kinematics.jacobian import of_points
from simrecon.kinematics.layout import FREE
from simrecon.kinematics.objective import Objective
from simrecon.kinematics.resumed import resume
from simrecon.kinematics.state import State
from simrecon.plan import SoftContact
from simrecon.planners import soft_contact
from simrecon.planners.soft_contact.asked import SHARE
from simrecon.planners.soft_contact.asked import asked as wanted
from simrecon.planners.soft_contact.curvature import _by_unknowns, curvature
from simrecon.planners.soft_contact.masses import Masses
from simrecon.planners.soft_contact.objective import Planned
from simrecon.planners.soft_contact.physics import Motion, World
from simrecon.planners.soft_contact.scales import Scales
from simrecon.sim.inverse_dynamics import inverse
from simrecon.types import Array, ContactWish, Evidence, KinematicFit, Reference
from tests.planners.conftest import SETTINGS, variables_of


@pytest.fixture(scope="module")
def reference(fit: KinematicFit, seen: Evidence) -> Reference:
    return planners.plan("soft_contact", fit, seen, SETTINGS)


@pytest.fixture(scope="module")
def planned(fit: KinematicFit, seen: Evidence) -> Planned:
    problem, _ = resume(fit, seen, SETTINGS.kinematics)
    friction = np.full(1 + len(fit.scene.items), 0.9)
    moved_m = fit.com_m + np.array([0.02, -0.01, 0.01])
    return Planned(
        problem,
        World(Masses.of(fit.body), fit.body.height_m, friction, Scales.of(SoftContact())),
        1.0,
        moved_m,
    )


def test_a_resumed_fit_stands_where_it_ended(fit: KinematicFit, seen: Evidence) -> None:
    problem, variables = resume(fit, seen, SETTINGS.kinematics)
    objective = Objective(problem)
    objective(variables.pack())
    for name in ("keypoint", "joint", "contact", "travel_rotation"):  # the 3D estimate is as large as it was
        assert objective.losses[name] == pytest.approx(fit.loss[name], rel=0.004), name


def test_wishes_that_hold_are_resumed_too(fit: KinematicFit, seen: Evidence) -> None:
    never, wild = ContactWish("left_knee", "never"), ContactWish("left_hand", "always")
    wished = replace(fit, wished=wishes.targets((never, wild), seen.times_s))
    problem, _ = resume(wished, seen, SETTINGS.kinematics)
    found = problem.observations.targets
    assert found is not None
    assert found.free[:, found.parts.index("left_knee")].all()
    assert not found.touch[:, found.parts.index("left_hand")].any()  # it is far from everything


def test_point_masses_have_the_body_s_centre_and_inertia(fit: KinematicFit, planned: Planned) -> None:
    model = mujoco.MjModel.from_xml_string(fit.body.mjcf)
    data = mujoco.MjData(model)
    data.qpos[:] = fit.qpos[7]
    mujoco.mj_forward(model, data)
    variables = variables_of(fit)
    motion = Motion(State(planned.problem, variables), planned.world)
    centre = data.subtree_com[1]
    np.testing.assert_allclose(motion.com_m[7], centre, atol=1e-5)
    expected = np.zeros((3, 3))
    for body in range(1, model.nbody):
        axes, arm = data.ximat[body].reshape(3, 3), data.xipos[body] - centre
        expected += axes @ np.diag(model.body_inertia[body]) @ axes.T
        expected += model.body_mass[body] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    arms = motion.masses_m[:, 7] - centre
    mass = planned.world.masses.mass_kg
    inertia = np.sum(mass * np.sum(arms**2, axis=1)) * np.eye(3) - (mass[:, None] * arms).T @ arms
    np.testing.assert_allclose(inertia, expected, atol=1e-4)


def wishing(fit: KinematicFit, seen: Evidence, world: World) -> World:
    """The world in which the left sole is to bear something, and the right one nothing."""
    asked = (
        *(ContactWish(f"left_{end}", "grounded") for end in ("heel", "toe")),
        ContactWish("right_toe", "never"),
    )
    wished = replace(fit, wished=wishes.targets(asked, seen.times_s))
    problem, variables = resume(wished, seen, SETTINGS.kinematics)
    return replace(world, asked=wanted(problem, variables, world.weight_N))


def test_what_is_to_touch_bears_and_what_is_free_does_not(
    fit: KinematicFit, seen: Evidence, planned: Planned
) -> None:
    asked = wishing(fit, seen, planned.world)
    parts = dict(zip(names(), planned.problem.contacts.parts, strict=True))

    def borne(world: World, *own: str) -> Array:
        motion = Motion(State(planned.problem, variables_of(fit)), world)
        pushed = np.linalg.norm(motion.explained(np.arange(len(motion.apart_m))).forces, axis=2)
        return np.asarray(pushed[:, np.concatenate([parts[name] for name in own])].sum(axis=1))

    left, right = ("left_heel", "left_toe"), ("right_toe",)
    assert asked.asked is not None
    for name in left:
        near = asked.asked.force_N[parts[name]].sum(axis=0)
        assert near.max() == pytest.approx(SHARE * planned.world.weight_N)
        assert (borne(asked, name)[near[1:-1] > 0] > rules.LOADED_N).all()
    assert borne(planned.world, *right).max() > 100.0
    assert borne(asked, *right).max() < 0.1 * borne(planned.world, *right).max()


@pytest.mark.parametrize(
    ("bare", "wished", "within"), [(True, False, 1e-5), (True, True, 1e-5), (False, False, 5e-3)]
)
def test_the_gradient_is_that_of_the_loss(
    fit: KinematicFit, seen: Evidence, planned: Planned, *, bare: bool, wished: bool, within: float
) -> None:
    if wished:
        world = wishing(fit, seen, planned.world)
        planned = Planned(planned.problem, world, planned.weight, planned.fit_com_m)
    if bare:
        flat, _ = resume(replace(fit, scene=replace(fit.scene, items=())), seen, SETTINGS.kinematics)
        planned = Planned(flat, planned.world, planned.weight, planned.fit_com_m)
    x, rng = variables_of(fit).pack(), np.random.default_rng(0)
    _, gradient = planned(x)
    moves = np.zeros((12, len(x)))
    moves[:, : FREE * planned.problem.frames] = rng.standard_normal((12, FREE * planned.problem.frames))
    slopes = np.array([planned(x + 1e-7 * move)[0] - planned(x - 1e-7 * move)[0] for move in moves]) / 2e-7
    # that the normal turns over the edges of the beam is left out
    assert np.linalg.norm(moves @ gradient - slopes) < within * np.linalg.norm(slopes)


def test_the_derivative_of_the_wrench(fit: KinematicFit, planned: Planned) -> None:
    variables, frame = variables_of(fit), 11
    motion = Motion(State(planned.problem, variables), planned.world)
    masses, skeleton = planned.world.masses, planned.problem.skeleton
    masses_moved = of_points(skeleton, motion.state.pose, masses.segments, motion.masses_m)
    rows = _by_unknowns(motion, masses_moved)
    rng = np.random.default_rng(1)
    move = rng.standard_normal((planned.problem.frames, FREE))
    x, moved = variables.pack(), layout.from_frames(move.ravel(), np.zeros(len(variables.pack()) - move.size))

    def wrench(at: Array) -> Array:
        return Motion(State(planned.problem, planned.problem.unpack(at)), planned.world).wrench[frame]

    expected = (wrench(x + 1e-6 * moved) - wrench(x - 1e-6 * moved)) / 2e-6
    found = sum(row[frame] @ move[frame + k] for k, row in enumerate(rows))
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max())


def test_the_curvature_is_positive(fit: KinematicFit, planned: Planned) -> None:
    for part in curvature(planned, variables_of(fit)):
        for block in part.blocks[0]:
            np.testing.assert_allclose(block, block.T, rtol=1e-6, atol=1e-6 * np.abs(block).max())
            assert np.linalg.eigvalsh(block)[0] > 0


def test_a_plan_obeys_dynamics(fit: KinematicFit, reference: Reference) -> None:
    weight = fit.body.mass_kg * 9.81
    assert reference.root_wrench is not None
    force, moment = (np.linalg.norm(part, axis=1) for part in np.split(reference.root_wrench, 2, axis=1))
    assert np.quantile(force, 0.95) < 0.03 * weight
    assert np.quantile(moment, 0.95) < 0.04 * weight * fit.body.height_m
    assert reference.contact_force_N is not None
    vertical = reference.contact_force_N[..., 2].sum(axis=1)
    assert vertical.mean() == pytest.approx(weight, rel=0.1)
    assert np.linalg.norm(reference.qpos[:, :3] - fit.qpos[:, :3], axis=1).mean() < 0.05


def test_its_forces_are_where_the_body_touches(fit: KinematicFit, reference: Reference) -> None:
    assert reference.contact_force_N is not None
    assert reference.contact_place_m is not None
    assert reference.contact is not None
    size = np.linalg.norm(reference.contact_force_N, axis=2)
    loaded = size > 0.05 * fit.body.mass_kg * 9.81
    apart, _ = scenes.distances(fit.scene, reference.contact_place_m)
    # corners of a sole are wider than the beam that it stands on
    assert apart.min(axis=0)[loaded].max() < 0.06
    assert (reference.contact[loaded] > 0.9).all()
    feet = np.array(["foot" in name for name in reference.contact_names])
    assert size[:, feet].sum() > 0.9 * size.sum()


def test_its_forces_come_from_near_by_and_change_slowly(fit: KinematicFit, reference: Reference) -> None:
    assert reference.contact_force_N is not None
    assert reference.contact_apart_m is not None
    weight = fit.body.mass_kg * 9.81
    far = np.linalg.norm(reference.contact_force_N, axis=2) * (reference.contact_apart_m > 0.03)
    assert np.quantile(far.sum(axis=1), 0.95) < 0.1 * weight
    rates = np.diff(reference.contact_force_N[..., 2].sum(axis=1)) / np.diff(fit.times_s)
    assert np.sqrt(np.mean(rates**2)) < 10.0 * weight


def test_a_plan_stays_where_the_fit_is(fit: KinematicFit, seen: Evidence, reference: Reference) -> None:
    away = np.linalg.norm(reference.com_m - fit.com_m, axis=1)
    assert 1e-4 < away.mean() < 0.02
    held = plan.overridden(SETTINGS, {"soft_contact.place_m": 1e-3}, "a test")
    near = planners.plan("soft_contact", fit, seen, held).com_m - fit.com_m
    assert np.linalg.norm(near, axis=1).mean() < away.mean() / 3


def test_the_torques_of_a_plan_leave_nothing_at_the_root(
    fit: KinematicFit, seen: Evidence, reference: Reference
) -> None:
    clock = schedule.clock(seen.times_s, 0.01)
    made = partial(problems.pose, fit, evidence=seen, clock=clock, plan=SETTINGS)
    problem = made(reference)
    torques = feedforward.torques(problem.model, problem.qpos, reference)
    assert torques is not None
    assert torques.shape == (len(seen.times_s), problem.model.nu)
    assert np.abs(torques).max() > 20.0  # legs carry the body
    rows = np.array([problem.model.body(name).id for name in reference.contact_segments])
    assert reference.contact_place_m is not None
    assert reference.contact_force_N is not None
    left = inverse(
        problem.model, problem.qpos, clock.frame_s, rows, reference.contact_place_m, reference.contact_force_N
    )[1:-1]
    weight = fit.body.mass_kg * 9.81
    assert np.quantile(np.linalg.norm(left[:, :3], axis=1), 0.95) < 0.05 * weight
    assert np.quantile(np.linalg.norm(left[:, 3:6], axis=1), 0.95) < 0.05 * weight * fit.body.height_m
    bare = made(planners.plan("none", fit, seen, SETTINGS))
    assert feedforward.torques(bare.model, bare.qpos, planners.plan("none", fit, seen, SETTINGS)) is None


def test_contact_names_are_those_of_the_contact_points(fit: KinematicFit, planned: Planned) -> None:
    names = soft_contact.contact_names(fit.body.primitives)
    assert len(names) == len(set(names)) == len(planned.problem.contacts.segments)


def test_a_clip_too_short_for_an_acceleration_is_planned_as_it_is(fit: KinematicFit, seen: Evidence) -> None:
    few = replace(fit, times_s=fit.times_s[:2], qpos=fit.qpos[:2], com_m=fit.com_m[:2])
    found = planners.plan("soft_contact", few, seen, SETTINGS)
    np.testing.assert_array_equal(found.qpos, few.qpos)
    assert "2 frames have no acceleration" in found.notes[0]
    assert found.planner == "none"


def test_the_curvature_of_a_flight(fit: KinematicFit, planned: Planned) -> None:
    variables = variables_of(fit)
    high = replace(variables, root_m=variables.root_m + np.array([0.0, 0.0, 50.0]))
    assert all(np.isfinite(part.blocks[0]).all() for part in curvature(planned, high))


def test_without_evidence_the_fit_s_own_landmarks_stand_for_it(fit: KinematicFit, seen: Evidence) -> None:
    """As of a motion on another body; where the evidence's world is another than the scene's, too."""
    nothing = replace(
        seen,
        keypoint_names=(),
        keypoints_px=seen.keypoints_px[:, :0],
        scores=seen.scores[:, :0],
        joint_names=(),
        joints_m=seen.joints_m[:, :0],
    )
    moved = np.eye(4)
    moved[:3, 3] = 5.0
    found = planners.plan("soft_contact", replace(fit, camera=None, world=moved), nothing, SETTINGS)
    assert 1e-4 < np.linalg.norm(found.qpos[:, :3] - fit.qpos[:, :3], axis=1).mean() < 0.05
    assert found.root_wrench is not None
    weight = fit.body.mass_kg * 9.81
    assert np.quantile(np.linalg.norm(found.root_wrench[:, :3], axis=1), 0.95) < 0.03 * weight


def test_the_settings_of_a_plan_count(fit: KinematicFit, seen: Evidence, reference: Reference) -> None:
    """A weight of next to nothing leaves the fit's poses, and their wrench unexplained."""
    light = plan.overridden(SETTINGS, {"soft_contact.weight": 1e-6, "soft_contact.units": [0.1]}, "a test")
    found = planners.plan("soft_contact", fit, seen, light)
    assert found.root_wrench is not None
    assert reference.root_wrench is not None
    assert np.abs(found.root_wrench).mean() > 3 * np.abs(reference.root_wrench).mean()


def test_a_seat_is_cheaper_than_feet(fit: KinematicFit, planned: Planned) -> None:
    world = planned.world
    cheap = replace(world, scales=replace(world.scales, seat=0.25))
    state = State(planned.problem, variables_of(fit))
    saved = Motion(state, world).cost - Motion(state, cheap).cost  # (n, G)
    names = np.array(planned.problem.skeleton.names)[planned.problem.contacts.segments]
    sits = np.isin(names, ("pelvis", "left_hip", "right_hip"))
    scale = world.scales.rest / world.weight_N**2
    np.testing.assert_allclose(saved / scale, np.broadcast_to(0.75 * sits, saved.shape), atol=1e-4)
