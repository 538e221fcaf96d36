"""Plans of the planner `centroidal`: they obey the laws of motion, and follow their input."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from simrecon import evidence as readers
from simrecon import kinematics, plan, planners, resources
from simrecon import scene as scenes
from simrecon.evidence import resample
from simrecon.planners.centroidal import phases
from simrecon.planners.centroidal.inputs import inputs
from simrecon.planners.centroidal.phases import Phase
from simrecon.planners.centroidal.settings import Solver, chosen, settings
from simrecon.types import Array, Friction, Ground, KinematicFit, Reference, Scene
from tests.support import rigid

ca = pytest.importorskip("casadi", reason="needs CasADi: install the extra centroidal")

from simrecon.planners.centroidal import geometric, limbs, stages  # noqa: E402
from simrecon.planners.centroidal.model import model  # noqa: E402
from simrecon.planners.centroidal.planned import Planned, at_frames  # noqa: E402
from simrecon.planners.centroidal.residual import wrench  # noqa: E402
from simrecon.planners.centroidal.rotation import momentum, rotation, turning  # noqa: E402
from simrecon.planners.centroidal.stages import Solved  # noqa: E402
from simrecon.planners.soft_contact.masses import Masses  # noqa: E402

WEIGHT_N = rigid.MASS_KG * 9.81


def solved(fit: KinematicFit) -> Solved:
    return stages.solve(inputs(fit, settings()), settings())


@pytest.fixture(scope="module")
def jump() -> Solved:
    return solved(rigid.jump())


@pytest.fixture(scope="module")
def jumped(jump: Solved) -> Planned:
    return at_frames(jump)


def test_a_jump_converges_and_nothing_is_broken(jump: Solved, jumped: Planned) -> None:
    assert jump.end.converged
    assert jumped.notes == ()
    assert np.linalg.norm(jumped.com_m - jumped.input_com_m, axis=1).max() < 0.25  # who jumps crouches first


def test_ends_of_phases_that_move_leave_the_unknowns_as_they_are() -> None:
    """A search goes on from unknowns that were found with other ends."""
    made = inputs(rigid.jump(), settings())
    before = tuple(target.touching.phases for target in made.targets)
    longer = tuple(
        phases.moved(own, np.array([p.end_s for p in own[:-1]]) + np.linspace(-0.15, 0.15, len(own) - 1))
        for own in before
    )
    counts = [model(made, settings(), each, free=False).unknowns.count for each in (before, longer)]
    assert counts[0] == counts[1]


def test_a_long_flight_has_more_cubics() -> None:
    short, long = (limbs.pieces(Phase(False, 0.0, end), settings().polynomials) for end in (0.3, 1.75))
    assert (short, long) == (6, 18)


def test_the_flight_is_a_parabola_without_force(jumped: Planned) -> None:
    flying = np.flatnonzero(~jumped.contact.any(axis=0))
    assert len(flying) > 8
    np.testing.assert_array_equal(jumped.force_N[:, flying], 0.0)
    inner = flying[3:-3]  # cubics of 0.1 s reach from the floor into the flight
    bend = np.diff(jumped.com_m, 2, axis=0)[inner - 1] / rigid.FRAME_S**2
    np.testing.assert_allclose(bend, np.tile([0.0, 0.0, -9.81], (len(inner), 1)), atol=0.05)


def test_the_mean_force_is_the_weight(jumped: Planned) -> None:
    """Who is at rest at both ends has been carried by the floor all the time."""
    total = np.trapezoid(jumped.force_N.sum(axis=0)[:, 2], jumped.times_s) / jumped.times_s[-1]
    assert total == pytest.approx(WEIGHT_N, rel=0.01)
    assert jumped.force_N.sum(axis=0)[:, 2].max() > 1.5 * WEIGHT_N


def test_forces_stay_in_the_friction_pyramid_at_all_times(jump: Solved) -> None:
    times = np.linspace(0.0, float(jump.model.inputs.times_s[-1]), 2000)
    unknowns = jump.model.x
    for limb in jump.model.limbs:
        force = np.array(ca.Function("force", [unknowns], [limb.force.at(times)])(jump.end.x))
        assert (force[:, 2] > -1e-4).all()
        assert (force[:, 2] < 1000.0 / (73.0 * 9.81) + 1e-4).all()
        assert (np.abs(force[:, :2]) < 0.5 * force[:, 2:] + 1e-4).all()
        assert force[:, 2].max() > 0.1


def test_feet_in_contact_stay_where_they_are_on_the_floor(jumped: Planned) -> None:
    for place, contact in zip(jumped.places_m, jumped.contact, strict=True):
        resting = contact[1:] & contact[:-1]
        assert np.linalg.norm(np.diff(place, axis=0)[resting], axis=1).max() < 1e-9
        np.testing.assert_allclose(place[contact, 2], 0.0, atol=1e-6)
        assert (place[:, 2] > -1e-4).all()
    foot = np.linalg.norm(jumped.places_m[0] - jumped.places_m[1], axis=1)
    np.testing.assert_allclose(foot, foot[0], atol=0.01)


def test_a_clip_without_contact_is_a_parabola() -> None:
    """The labels say nothing of contact, and the input hovers high up: the plan falls."""
    free = rigid.fit(np.tile([0.0, 0.0, 2.0], (19, 1)), np.zeros(19))
    found = at_frames(solved(free))
    assert found.converged
    assert not found.force_N.any()
    bend = np.diff(found.com_m, 2, axis=0) / rigid.FRAME_S**2
    np.testing.assert_allclose(bend, np.tile([0.0, 0.0, -9.81], (17, 1)), atol=1e-3)
    assert found.com_m[:, 2].mean() == pytest.approx(found.input_com_m[:, 2].mean(), abs=0.1)


def test_a_clip_that_flies_at_an_end_has_the_velocity_of_its_parabola() -> None:
    fit = rigid.jump()
    cut = slice(20, None)  # in the flight, which lasts from frame 15 to 30
    later = inputs(
        replace(
            fit, times_s=fit.times_s[cut], qpos=fit.qpos[cut], com_m=fit.com_m[cut],
            contacts=None if fit.contacts is None else fit.contacts.at(cut),
        ),
        settings(),
    )  # fmt: skip
    start, end = geometric.boundary_velocities(later, 5)
    assert start is not None
    assert end is not None
    since = 20 * rigid.FRAME_S - 0.5
    assert start[2] == pytest.approx(9.81 * (0.25 - since), abs=0.02)
    np.testing.assert_allclose(end, 0.0, atol=1e-9)


def test_the_paper_s_weights_can_be_had() -> None:
    assert chosen("measured") == settings()
    paper = chosen("paper").weights
    assert (paper.com, paper.turn, paper.point, paper.duration) == (0.4, 1.7, 0.3, 0.1)
    assert (paper.com_velocity, paper.point_velocity, paper.com_acceleration) == (1e-3, 0.1, 1e-4)


def test_what_cannot_be_is_said_with_its_constraint_and_seconds() -> None:
    """Who stands on perfect ice cannot leave it at 3 m/s sideways."""
    since = rigid.FRAME_S * np.clip(np.arange(26) - 15, 0, None)
    moves = np.column_stack((3.0 * since, 0 * since, since * (2.5 - 4.9 * since)))
    ice = Scene(ground=Ground(friction=Friction(sliding=0.0)))
    quick = replace(settings(), solver=Solver(60, 1e-4), durations=replace(settings().durations, rounds=0))
    found = at_frames(stages.solve(inputs(rigid.fit(moves, since == 0.0, scene=ice), quick), quick))
    assert found.notes
    assert found.notes[0].startswith("no plan keeps all constraints; the best one breaks ")
    assert re.search(r"(velocity boundaries|forces) at \d.\d\d to \d.\d\d s", found.notes[0])
    assert np.isfinite(found.com_m).all()


def test_slippery_ground_lowers_the_pyramid() -> None:
    fit = rigid.jump()
    icy = replace(fit, scene=Scene(ground=Ground(friction=Friction(sliding=0.05))))
    force = at_frames(solved(icy)).force_N
    assert (np.abs(force[..., :2]) <= 0.05 * force[..., 2:] + 0.1).all()


@pytest.mark.parametrize(("mass_kg", "distribution"), [(36.5, "heavy_head"), (146.0, "heavy_arms")])
def test_other_characters_stand_too(mass_kg: float, distribution: str) -> None:
    """Rempe 2020, appendix D: forces that a point may exert grow with the mass."""
    body = rigid.person(mass_kg, distribution)
    found = at_frames(solved(rigid.fit(np.zeros((16, 3)), np.ones(16), body)))
    assert found.notes == ()
    total = np.trapezoid(found.force_N.sum(axis=0)[:, 2], found.times_s) / found.times_s[-1]
    assert total == pytest.approx(9.81 * mass_kg, rel=0.01)


def test_the_paper_s_way_has_the_acceleration_of_the_forces_at_its_points() -> None:
    points = replace(settings(), checks=replace(settings().checks, integral_points=0))
    fit = rigid.jump(flight_s=0.3)
    found = stages.solve(inputs(fit, points), points)
    assert found.end.converged
    at = np.linspace(0.0, 1.3, 14)
    total = sum(limb.force.at(at) for limb in found.model.limbs)
    values = ca.Function("at", [found.model.x], [found.model.com.at(at, 2), total])(found.end.x)
    acceleration, force = (np.array(value) for value in values)
    np.testing.assert_allclose(acceleration / 9.81 + [0.0, 0.0, 1.0], force, atol=1e-3)


def test_the_moments_are_the_rate_of_change_of_angular_momentum() -> None:
    rng = np.random.default_rng(2)
    axes, inertia = (2, 0, 1), np.diag([9.0, 8.0, 1.5]) + 0.3
    start, first, second = 0.3 * rng.standard_normal((3, 3))
    held, own = rotation(axes), momentum(axes)

    def moved(t: Array) -> Array:
        """In the world, at time t (1,)."""
        turn = start + first * t + 0.5 * second * t**2
        ahead = [np.array(held((turn + s * (first + second * t)).reshape(1, 3))) for s in (1e-6, -1e-6)]
        here = np.array(held(turn.reshape(1, 3)))
        crossed = here.T @ (ahead[0] - ahead[1]) / 2e-6
        spin = np.array([crossed[2, 1], crossed[0, 2], crossed[1, 0]])
        return np.asarray(here @ inertia @ spin)

    rate = (moved(np.array([1e-4])) - moved(np.array([-1e-4]))) / 2e-4
    at_once = own(start.reshape(1, 3), first.reshape(1, 3), inertia, np.zeros((1, 3)))
    np.testing.assert_allclose(np.array(at_once).ravel(), moved(np.zeros(1)), atol=1e-6)
    left = turning(axes)(
        *(value.reshape(1, 3) for value in (start, first, second)), inertia, rate.reshape(1, 3)
    )
    np.testing.assert_allclose(np.array(left).ravel(), 0.0, atol=1e-4)
    other = turning(axes)(
        *(value.reshape(1, 3) for value in (start, first, second)), inertia, np.zeros((1, 3))
    )
    assert np.abs(np.array(other)).max() > 0.1


@pytest.fixture(scope="module")
def walk() -> tuple[KinematicFit, Reference]:
    whole, _ = resample(readers.read(resources.folder("example") / "beam.npz"))
    settings_ = plan.read("quick")
    fit = kinematics.fit(whole, scenes.read(resources.folder("example") / "beam.toml"), settings_.kinematics)
    return fit, planners.plan("centroidal", fit, whole, settings_)


def test_the_walk_of_the_example_is_planned(walk: tuple[KinematicFit, Reference]) -> None:
    fit, found = walk
    assert found.planner == "centroidal"
    assert not [note for note in found.notes if "no plan" in note or "converge" in note]
    assert found.contact_force_N is not None
    assert found.contact is not None
    assert found.contact_names[:4] == rigid.FEET
    weight = fit.body.mass_kg * 9.81
    assert found.contact_force_N.sum(axis=1)[:, 2].mean() == pytest.approx(weight, rel=0.05)
    before, after = (kinematics.configurations(fit.body, qpos)[1] for qpos in (fit.qpos, found.qpos))
    assert np.linalg.norm(after - before, axis=2).mean() < 0.05
    assert found.root_wrench is not None
    assert np.median(np.linalg.norm(found.root_wrench[:, :3], axis=1)) < 0.2 * weight


def test_the_full_body_has_the_planned_points(walk: tuple[KinematicFit, Reference]) -> None:
    fit, found = walk
    target = inputs(replace(fit, qpos=found.qpos), settings()).targets
    assert found.contact_place_m is not None
    for column, entry in enumerate(target[:4]):
        off = np.linalg.norm(entry.place_m - found.contact_place_m[:, column], axis=1)
        assert off.mean() < 0.005


def test_the_residual_of_a_body_that_stands_is_its_weight() -> None:
    fit = rigid.fit(np.zeros((8, 3)), np.ones(8))
    nothing = np.zeros((8, 1, 3))
    left = wrench(fit.body, fit.qpos, fit.times_s, nothing, nothing)
    np.testing.assert_allclose(left[:, :3], np.tile([0.0, 0.0, WEIGHT_N], (8, 1)), atol=1e-6)
    under = np.tile(fit.com_m[:1, None], (8, 1, 1))
    carried = wrench(fit.body, fit.qpos, fit.times_s, under, np.tile([0.0, 0.0, WEIGHT_N], (8, 1, 1)))
    assert Masses.of(fit.body).total_kg == pytest.approx(rigid.MASS_KG)
    np.testing.assert_allclose(carried, 0.0, atol=1e-2)
