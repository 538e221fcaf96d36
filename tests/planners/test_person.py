"""Size and lengths of a person that a plan moves jointly with the poses, and plans on splines."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import plan, planners
from simrecon.kinematics import configurations, layout
from simrecon.kinematics.layout import FREE, Variables
from simrecon.kinematics.resumed import resume
from simrecon.kinematics.state import State
from simrecon.plan import SoftContact
from simrecon.planners.soft_contact import person
from simrecon.planners.soft_contact.curvature import curvature
from simrecon.planners.soft_contact.masses import Masses
from simrecon.planners.soft_contact.nodes import Nodes
from simrecon.planners.soft_contact.objective import Planned
from simrecon.planners.soft_contact.physics import Motion, World
from simrecon.planners.soft_contact.scales import Scales
from simrecon.types import Array, Evidence, KinematicFit
from tests.planners.conftest import SETTINGS

SIX_DIGITS_M = 3e-6
"""What MJCF's six digits leave of a place, along a chain of bones."""


@pytest.fixture(scope="module")
def start(fit: KinematicFit, seen: Evidence) -> tuple[Planned, Variables]:
    flat = replace(fit, scene=replace(fit.scene, items=()))
    problem, variables = resume(flat, seen, SETTINGS.kinematics, lengths=True)
    masses = Masses.of(fit.body).scaled(np.exp(-variables.log_scale))
    world = World(masses, fit.body.height_m, np.full(1, 0.9), Scales.of(SoftContact()))
    return Planned(problem, world, 1.0, fit.com_m, lengths=True), variables


def _moved(start: Variables) -> Variables:
    lengths = start.lengths + 0.03 * np.random.default_rng(7).standard_normal(len(start.lengths))
    return replace(start, log_scale=start.log_scale + 0.02, sole_m=start.sole_m + 0.004, lengths=lengths)


def test_the_gradient_by_size_and_lengths_is_that_of_the_loss(start: tuple[Planned, Variables]) -> None:
    planned, variables = start
    x = _moved(variables).pack()
    _, gradient = planned(x)
    first = FREE * planned.problem.frames
    own = slice(first, first + 2 + len(variables.lengths))
    steps = 1e-5 * np.eye(len(x))[own]
    slopes = np.array([planned(x + step)[0] - planned(x - step)[0] for step in steps]) / 2e-5
    np.testing.assert_allclose(gradient[own], slopes, rtol=1e-4, atol=0.1)  # forces are solved to some digits


def test_the_person_of_a_fit_is_taken_up_as_it_was_measured(
    fit: KinematicFit, start: tuple[Planned, Variables]
) -> None:
    """So the problem has the fit's own body."""
    planned, variables = start
    body = person.grown(fit.body, planned.problem, variables, variables)
    for ours, theirs in zip(body.primitives, fit.body.primitives, strict=True):
        np.testing.assert_allclose(ours.points_m, theirs.points_m, atol=1e-9)
    skeletons = body.skeleton, fit.body.skeleton
    for name in ("offsets_m", "point_offsets_m"):
        ours_m, theirs_m = (getattr(one, name) for one in skeletons)
        np.testing.assert_allclose(ours_m, theirs_m, atol=1e-6)
    state = State(planned.problem, variables)
    com, marks = configurations(fit.body, fit.qpos)
    np.testing.assert_allclose(np.swapaxes(marks, 0, 1), state.landmarks_m, atol=SIX_DIGITS_M)
    np.testing.assert_allclose(com, Motion(state, planned.world).com_m, atol=1e-5)
    assert np.abs(variables.lengths).max() > 1e-3


def test_a_body_that_is_not_of_the_evidence_s_lengths_stays(fit: KinematicFit, seen: Evidence) -> None:
    skeleton = fit.body.skeleton
    other = replace(skeleton, offsets_m=skeleton.offsets_m + np.array([0.0, 0.0, 0.02]))
    strange = replace(fit, body=replace(fit.body, skeleton=other))
    _, variables = resume(strange, seen, SETTINGS.kinematics, lengths=True)
    assert len(variables.lengths) == 0


def test_the_curvature_by_size_and_lengths(start: tuple[Planned, Variables]) -> None:
    """What dynamics add to it is Gauss and Newton's, of the wrench where no force explains it."""
    planned, variables = start
    high = replace(variables, root_m=variables.root_m + np.array([0.0, 0.0, 50.0]))
    bare = Planned(planned.problem, planned.world, 1.0, planned.fit_com_m)
    parts = zip(curvature(planned, high), curvature(bare, high), strict=True)
    count = 2 + len(variables.lengths)
    found = np.sum([moves.corner - stays.corner for moves, stays in parts], axis=0)[:count, :count]

    def residual(shared: Array) -> Array:
        there = replace(high, log_scale=shared[0], sole_m=shared[1], lengths=shared[2:])
        motion = Motion(State(planned.problem, there), planned.world)
        rough = 4.0 / planned.world.change(planned.problem.dt) ** 2
        away = motion.com_m / planned.world.scales.place_m
        return np.concatenate((np.sqrt(1.0 + rough) * motion.wrench.ravel(), away.ravel()))

    at = np.concatenate(([high.log_scale, high.sole_m], high.lengths))
    steps = 1e-5 * np.eye(count)
    slopes = np.stack([(residual(at + step) - residual(at - step)) / 2e-5 for step in steps], axis=1)
    expected = planned.problem.dt * slopes.T @ slopes
    np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-3 * np.abs(expected).max())


def test_the_body_of_a_plan_is_the_one_that_was_searched(
    fit: KinematicFit, start: tuple[Planned, Variables]
) -> None:
    planned, variables = start
    moved = _moved(variables)
    body = person.grown(fit.body, planned.problem, variables, moved)
    state = State(planned.problem, moved)
    qpos = layout.to_qpos(moved.root_m, planned.problem.base, moved.rotvecs)
    com, marks = configurations(body, qpos)
    np.testing.assert_allclose(np.swapaxes(marks, 0, 1), state.landmarks_m, atol=SIX_DIGITS_M)
    np.testing.assert_allclose(com, Motion(state, planned.world).com_m, atol=1e-3)  # soles have mass
    assert mujoco.MjModel.from_xml_string(body.mjcf).body_mass.sum() == pytest.approx(fit.body.mass_kg)
    taller = bodies.stature_m(body.skeleton) / bodies.stature_m(fit.body.skeleton)
    assert body.height_m / fit.body.height_m == pytest.approx(taller, abs=0.01)


def test_a_plan_may_move_lengths(fit: KinematicFit, seen: Evidence) -> None:
    asked = {"soft_contact.lengths": True, "soft_contact.units": [0.1], "soft_contact.evaluations": 20}
    found = planners.plan("soft_contact", fit, seen, plan.overridden(SETTINGS, asked, "a test"))
    assert found.body is not None
    ours, theirs = (np.linalg.norm(body.skeleton.offsets_m[1:], axis=1) for body in (found.body, fit.body))
    assert 1e-4 < np.abs(ours / theirs - 1).max() < 0.2
    np.testing.assert_allclose(found.com_m, configurations(found.body, found.qpos)[0])


def test_a_plan_on_splines(fit: KinematicFit, seen: Evidence) -> None:
    """Its root lies on them, it explains its forces, and it is near the fit."""
    found = planners.plan(
        "soft_contact", fit, seen, plan.overridden(SETTINGS, {"soft_contact.node_spacing_s": 0.15}, "a test")
    )
    nodes = Nodes.spread(len(fit.times_s), 9)
    np.testing.assert_allclose(nodes.smoothed(found.qpos[:, :3]), found.qpos[:, :3], atol=1e-5)
    away = np.linalg.norm(found.qpos[:, :3] - fit.qpos[:, :3], axis=1)
    assert 1e-3 < away.mean() < 0.04
    assert found.root_wrench is not None
    weight = fit.body.mass_kg * 9.81
    assert np.quantile(np.linalg.norm(found.root_wrench[:, :3], axis=1), 0.95) < 0.05 * weight
