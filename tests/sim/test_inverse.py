"""Derivatives of whole steps against central differences of MuJoCo's own steps."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from simrecon import body as bodies
from simrecon import prior
from simrecon import scene as scenes
from simrecon.body import strength
from simrecon.geometry import rotations
from simrecon.sim.derivatives import Transitions, transitions
from simrecon.sim.inverse import Inverse
from simrecon.sim.models import compile_text
from simrecon.sim.quiet import unlogged
from simrecon.sim.state import displace, forward, initial_state, qpos_of, qvel_of, simulate
from simrecon.types import Array, Body

Floats = NDArray[np.floating[Any]]

STEP_S = 0.01
MOVE = 1e-6
PERSON_NV = 54

EXACT = 1e-6
"""Of the largest entry of a block: single precision."""
CONTACT = 1e-3
"""By positions where something pushes: how a contact gives way depends on them, which is left out."""
DIFFERENCES = 1e-2
"""Where MuJoCo's one-sided differences are taken."""

BALL = '[[item]]\nname = "b"\nkind = "ball"\nposition_m = [1, 0, 0]\nmass_kg = 2\nradius_m = 0.15\n'
BOX = '[[item]]\nname = "b"\nkind = "box"\nposition_m = [9, 0, 9]\nsize_m = [0.2, 0.4, 0.7]\nmass_kg = 3\n'
SPRUNG = "[ground]\nstiffness_Npm = 3e4\ndamping_Nspm = 1500.0\n"
BALL_OVER_FOOT_M = np.array([0.0, 0.0, 0.2])
MAT = '[[item]]\nname = "mat"\nkind = "mat"\nposition_m = [0, 0, 0]\nheight_m = 0.1\n'
TRAMPOLINE = '[[item]]\nname = "t"\nkind = "trampoline"\nposition_m = [0, 0, 0]\nheight_m = 0.5\n'


@dataclass(frozen=True)
class Case:
    """A person somewhere, stepped for a while under a constant control, which then is what is looked at.

    Attributes:
        scene: TOML; strength: of the plan. height_m: of the pelvis over where the feet are on the floor.
        turns: rotation vectors that the control adds to the relaxed pose, by joint.
        speed: of random velocities at the start.
        steps: before the one that is differentiated.
        closed: whether the closed form is used.
        touches: names of geoms that must touch.
        limits: whether it starts in that pose, with a joint beyond its limit.
        saturated: number of motors that must be at their largest force.
        by_position: tolerance of slopes by positions, and of the others.
    """

    scene: str = ""
    strength: str = "usual"
    height_m: float = 0.0
    turns: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    speed: float = 0.0
    steps: int = 0
    closed: bool = True
    touches: tuple[str, str] | None = None
    limits: bool = False
    saturated: int = 0
    by_position: float = CONTACT
    others: float = EXACT


CASES = {
    "flight": Case(height_m=1.0, speed=2.0, by_position=EXACT),
    "feet": Case(steps=40, touches=("ground", "left_foot")),
    "slipping": Case("[ground]\nfriction = 0.05\n", speed=1.0, steps=6, touches=("ground", "left_foot")),
    "limit": Case(height_m=3.0, turns={"neck": (1.0, 0.9, 0)}, steps=1, limits=True, by_position=EXACT),
    "self": Case(
        height_m=3.0,
        turns={"left_hip": (-0.5, 0, 0), "right_hip": (0.5, 0, 0)},
        steps=40,
        touches=("left_thigh", "right_thigh"),
    ),
    "ball": Case(BALL, steps=4, touches=("item/b", "left_shin")),
    "saturated": Case(
        height_m=1.0, turns={"spine": (0, 2.0, 0), "left_hip": (0, 3.0, 0)}, saturated=2, by_position=EXACT
    ),
    "trained": Case(
        strength="trained", turns={"spine": (0, 0.3, 0)}, steps=30, touches=("ground", "left_foot")
    ),
    "sprung": Case(SPRUNG, steps=30, touches=("ground", "left_foot")),
    "mat": Case(MAT, height_m=0.1, steps=30),
    "trampoline": Case(
        TRAMPOLINE,
        height_m=0.5,
        steps=30,
        closed=False,
        touches=("item/t/tile_6_3", "left_foot"),
        by_position=DIFFERENCES,
        others=DIFFERENCES,
    ),
}


@cache
def person() -> Body:
    return bodies.build(bodies.scaled({}, 1.75), height_m=1.75, mass_kg=70.0)


@dataclass(frozen=True, eq=False)
class At:
    """One step of a case: where it begins, where it ends, the control that leads there."""

    model: mujoco.MjModel
    start: Array
    end: Array
    ctrl: Array

    def data(self) -> mujoco.MjData:
        """With all that is known before the step."""
        data = forward(self.model, self.start)
        data.ctrl[:] = self.ctrl
        mujoco.mj_forward(self.model, data)
        return data

    def found(self, *, closed: bool) -> Transitions:
        inverse = Inverse(self.model)
        inverse.closed = closed
        return transitions(inverse, np.stack((self.start, self.end)), self.ctrl[None])


@cache
def at(name: str) -> At:
    """The step of a case."""
    case, own = CASES[name], person()
    text = strength.strengthened(own.mjcf, case.strength)
    model = compile_text(scenes.build(text, scenes.parse(case.scene), STEP_S))
    model.opt.tolerance = 1e-12  # differences see where the solver stops
    relaxed = prior.gaussian(own.skeleton).mean_rad
    added = np.zeros((16, 3))
    for joint, turn in case.turns.items():
        added[own.skeleton.names.index(joint) - 1] = turn
    rng, qpos = np.random.default_rng(1), model.qpos0.copy()
    qpos[:7] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    qpos[7:71] = rotations.exp(relaxed + case.limits * added).ravel()
    qpos[2] = case.height_m - lowest(model, qpos) - 0.002
    if case.scene == BALL:
        qpos[71:74] = foot(model, qpos) + BALL_OVER_FOOT_M
    velocity = np.zeros(model.nv)
    velocity[:PERSON_NV] = case.speed * rng.normal(size=PERSON_NV)
    ctrl = (relaxed + added).ravel()
    states = simulate(
        model, initial_state(model, qpos, velocity), np.repeat(ctrl[None], case.steps + 1, axis=0)
    )
    return At(model, states[-2], states[-1], ctrl)


def lowest(model: mujoco.MjModel, qpos: Array) -> float:
    """Height of the lowest point of the feet, of their boxes."""
    data = forward(model, initial_state(model, qpos, np.zeros(model.nv)))
    lowest = np.inf
    for name in ("left_foot", "right_foot"):
        own = data.geom(name)
        lowest = min(lowest, own.xpos[2] - np.abs(own.xmat.reshape(3, 3)[2]) @ model.geom(name).size)
    return float(lowest)


def foot(model: mujoco.MjModel, qpos: Array) -> Array:
    place: Array = (
        forward(model, initial_state(model, qpos, np.zeros(model.nv))).geom("left_foot").xpos.copy()
    )
    return place


@cache
def expected(name: str) -> tuple[Array, Array]:
    """Derivatives of the step by its state (2 V, 2 V) and its control (2 V, U), by central differences."""
    slope, states = differences(at(name)), 2 * at(name).model.nv
    return slope[:, :states], slope[:, states:]


def differences(here: At) -> Array:
    """Both beside each other."""
    model, nv = here.model, here.model.nv
    slope = np.empty((2 * nv, 2 * nv + model.nu))
    data = mujoco.MjData(model)

    def after(move: Array) -> Array:
        start = here.start[None].copy()
        displace(model, start, move[None, :nv], move[None, nv : 2 * nv])
        mujoco.mj_setState(model, data, start[0], mujoco.mjtState.mjSTATE_INTEGRATION)
        data.ctrl[:] = here.ctrl + move[2 * nv :]
        mujoco.mj_step(model, data)
        tangent = np.empty(nv)
        mujoco.mj_differentiatePos(model, tangent, 1.0, qpos_of(model, here.end), data.qpos)
        return np.concatenate((tangent, data.qvel))

    for column, move in enumerate(MOVE * np.eye(slope.shape[1])):
        slope[:, column] = (after(move) - after(-move)) / (2 * MOVE)
    return slope


@pytest.mark.parametrize("name", CASES)
def test_the_case_is_what_it_is_called(name: str) -> None:
    case, here = CASES[name], at(name)
    data = here.data()
    assert Inverse(here.model).closed is case.closed
    pairs = {tuple(here.model.geom(int(geom)).name for geom in contact.geom) for contact in data.contact}
    assert (data.nefc == 0) is (name in ("flight", "saturated"))
    if case.touches is not None:
        assert case.touches in pairs | {(two, one) for one, two in pairs}, pairs
    assert not case.limits or (data.efc_type == mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT).any()
    force, limit = data.actuator_force, here.model.actuator_forcerange[:, 1]
    assert (np.abs(force) >= limit).sum() >= case.saturated


def assert_near(found: Floats, wanted: Floats, tolerance: float) -> None:
    np.testing.assert_allclose(found, wanted, rtol=0, atol=tolerance * np.abs(wanted).max())


@pytest.mark.parametrize("name", CASES)
def test_a_step_changes_with_velocity_and_control_as_differences_say(name: str) -> None:
    case, (by_state, by_control) = CASES[name], expected(name)
    nv, found = at(name).model.nv, at(name).found(closed=case.closed)
    for rows in (slice(nv), slice(nv, None)):
        assert_near(found.state[0, rows, nv:], by_state[rows, nv:], case.others)
        assert_near(found.control[0, rows], by_control[rows], case.others)


@pytest.mark.parametrize("name", CASES)
def test_a_step_changes_with_position_as_differences_say(name: str) -> None:
    case, (by_state, _) = CASES[name], expected(name)
    nv, found = at(name).model.nv, at(name).found(closed=case.closed)
    for rows in (slice(nv), slice(nv, None)):
        assert_near(found.state[0, rows, :nv], by_state[rows, :nv], case.by_position)


@pytest.mark.parametrize("name", [name for name in CASES if name not in ("sprung", "mat", "trampoline")])
def test_the_closed_form_is_what_differences_of_inverse_dynamics_give(name: str) -> None:
    nv, one, other = at(name).model.nv, *(at(name).found(closed=closed) for closed in (True, False))
    by_position = max(CASES[name].by_position, DIFFERENCES)
    assert_near(one.state[0, nv:, :nv], other.state[0, nv:, :nv], by_position)
    assert_near(one.state[0, nv:, nv:], other.state[0, nv:, nv:], DIFFERENCES)
    assert_near(one.control[0], other.control[0], DIFFERENCES)


def test_motors_at_their_largest_force_are_not_heard() -> None:
    here, nv = at("saturated"), at("saturated").model.nv
    force = np.abs(here.data().actuator_force)
    deaf = force >= here.model.actuator_forcerange[:, 1]
    heard = np.abs(here.found(closed=True).control[0, nv:]).max(axis=0)
    assert not heard[deaf].any()
    assert (heard[~deaf] > 1e-3).all()


def test_consecutive_steps_are_those_one_by_one() -> None:
    here = at("feet")
    ctrl = np.repeat(here.ctrl[None], 4, axis=0)
    states = simulate(here.model, here.start, ctrl)
    whole = transitions(Inverse(here.model), states, ctrl)
    for step in range(4):
        one = transitions(Inverse(here.model), states[step : step + 2], ctrl[step : step + 1])
        np.testing.assert_allclose(whole.state[step], one.state[0], rtol=1e-5, atol=1e-5)
        np.testing.assert_allclose(whole.control[step], one.control[0], rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("value", [np.nan, np.inf, 1e200])
def test_a_step_that_is_not_finite_leaves_the_velocity_alone(value: float, closed: bool) -> None:
    here, nv = at("flight"), at("flight").model.nv
    ctrl = np.repeat(here.ctrl[None], 2, axis=0)
    states = simulate(here.model, here.start, ctrl)
    inverse = Inverse(here.model)
    inverse.closed = closed
    sound = transitions(inverse, states, ctrl)
    qvel_of(here.model, states)[0, 10] = value
    with unlogged(), np.errstate(all="ignore"):
        found = transitions(inverse, states, ctrl)
    np.testing.assert_array_equal(found.state[0, nv:, :nv], 0.0)
    np.testing.assert_array_equal(found.state[0, nv:, nv:], np.eye(nv))
    np.testing.assert_array_equal(found.control[0], 0.0)
    assert np.isfinite(found.state).all()
    np.testing.assert_allclose(found.state[1], sound.state[1], atol=1e-5)


@pytest.mark.parametrize(("closed", "tolerance"), [(True, 1e-2), (False, EXACT)])
def test_a_box_that_spins_alone(closed: bool, tolerance: float) -> None:
    """MuJoCo takes gyroscopic forces of a body alone at the end of a step; the closed form at its start."""
    model = compile_text(scenes.build(person().mjcf, scenes.parse(BOX), STEP_S))
    qpos, velocity, nv = model.qpos0.copy(), np.zeros(model.nv), model.nv
    qpos[2] = 5.0
    velocity[PERSON_NV:] = 8 * np.random.default_rng(0).normal(size=6)
    ctrl = np.zeros(model.nu)
    states = simulate(model, initial_state(model, qpos, velocity), ctrl[None])
    here = At(model, states[0], states[1], ctrl)
    box = np.r_[PERSON_NV:nv, nv + PERSON_NV : 2 * nv]
    found = here.found(closed=closed).state[0][np.ix_(box, box)]
    assert_near(found, differences(here)[np.ix_(box, box)], tolerance)
