"""The slopes of a window's loss, against central differences of the loss and of its residuals."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from simrecon import kinematics, schedule
from simrecon import scene as scenes
from simrecon.engines import warm_start
from simrecon.engines.borne import Borne
from simrecon.engines.problem import Problem
from simrecon.engines.sampling import jacobian
from simrecon.engines.sampling.jacobian import Linearised, linearise
from simrecon.engines.sampling.task import Task, simulator
from simrecon.engines.sampling.terms import TERMS, LossTerm, Moves, Seen
from simrecon.engines.wished import Wished
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.optim import gauss_newton
from simrecon.sim.rollout import Simulator
from simrecon.sim.state import forward
from simrecon.types import Array, Camera
from tests.engines.conftest import Makers

FRAMES = 9
MOVE = 1e-5
"""Of an unknown, in deviations."""
TOLERANCE = 2e-3
"""Of the largest slope: how contacts give way depends weakly on the pose, which is left out."""

BALL = """
[[item]]
name = "ball"
kind = "ball"
position_m = [0.19, 0.09, 0.0]
radius_m = 0.1
mass_kg = 2.0
"""
SPRUNG = "[ground]\nstiffness_Npm = 3e4\ndamping_Nspm = 1500.0\n"
LOSSES = {
    "prior": 0.05,
    "total_variation": 1.0,
    "joint_limit": 1.0,
    "landmark": 100.0,
    "landmark_velocity": 0.5,
    "planted": 10.0,
    "wished": 30.0,
    "borne": 2.0,
    "force": 3.0,
    "moment": 2.0,
    "prior_rate_hz": 15.0,
}
KINDS = ("air", "floor", "later", "camera", "moving", "ball", "sprung")


@dataclass(frozen=True, eq=False)
class Sharp(LossTerm):
    """A term as it is: reweighted at the lengths themselves, however short."""

    inner: LossTerm

    def value(self, seen: Seen) -> Array:
        return self.inner.value(seen)

    def residual(self, seen: Seen) -> gauss_newton.Term:
        return replace(self.inner.residual(seen), floor=1e-12)

    def slope(self, seen: Seen, moves: Moves) -> Array:
        return self.inner.slope(seen, moves)


def filmed(kind: str) -> Problem:
    """A person who sways: in the air, on the floor, on one that
    gives way, before a camera that may move, or beside a ball.
    """
    camera, air = Makers.camera, kind == "air"
    losses = LOSSES | ({"rate_hz": 15.0, "reprojection": 1.0} if kind in ("camera", "moving") else {})
    if kind in ("ball", "sprung"):  # what a foot feels of what moves has no slope
        losses = losses | {"force": 0.0, "moment": 0.0, "borne": 0.0}
    plan = Makers.settings(population=20, start=0.02, length_s=0.2, overlap_s=0.1, **losses)
    if kind not in ("camera", "moving"):
        scene = scenes.parse({"ball": BALL, "sprung": SPRUNG}.get(kind, ""))
        fit = replace(Makers.standing(frames=FRAMES), scene=scene)
        fit.qpos[:, 2] += 1.0 * air
        return narrow(Makers.clip(plan, fit))
    if kind == "moving":
        turns = rotations.matrix(rotations.exp(np.linspace(0, 0.2, FRAMES)[:, None] * [0.3, 1.0, 0.2]))
        path = np.repeat(camera.path[:1], FRAMES, axis=0) if camera.path is not None else np.zeros(0)
        path[:, :3, :3] = turns @ path[:, :3, :3]
        path[:, 0, 3] += np.linspace(0, 0.3, FRAMES)
        camera = Camera(camera.lens, path)
    else:
        camera = cameras.lasting(camera, FRAMES)
    fit = Makers.standing(camera, FRAMES)
    points = kinematics.configurations(fit.body, fit.qpos)[1]
    rows = [fit.body.skeleton.point_names.index(name) for name in ("nose", "left_wrist")]
    seen = replace(
        Makers.unseen(FRAMES),
        keypoint_names=("Nose", "LWrist"),
        keypoints_px=cameras.project(camera, points[:, rows]) + 3.0,
        scores=np.full((FRAMES, 2), [0.8, 0.5]),
        camera=camera,
    )
    return narrow(Makers.clip(plan, fit, seen))


def narrow(problem: Problem) -> Problem:
    """The same with ranges of the joints that their pose is a little beyond, or within, half planted,
    and with wishes of all points.
    """
    pose = rotations.log(problem.orientations[0, 1:])
    limits = np.stack((pose - 0.02, pose - 0.01), axis=-1)
    half = np.full_like(problem.planted, 0.5)
    wished = Wished(problem.points_m - [0.0, 0.01, 0.02], np.full_like(problem.planted, 1.0))
    pushed = np.full((len(half), 2, 6), 200.0)
    wrenches, places = np.full((len(half), 2, 6), 100.0), np.full((len(half), 2, 3), 0.3)
    borne = Borne(("pelvis", "left_ankle"), wrenches, places, np.full((len(half), 2), 0.5))
    bare = replace(problem, limits_rad=limits, planted=half)
    return replace(bare, wished=wished, pushed=pushed, borne=borne)


@dataclass(frozen=True, eq=False)
class Case:
    """A window of a clip, a point x (n,) of its search space, and the deviations (n,) of its unknowns."""

    task: Task
    simulator: Simulator
    x: Array
    scale: Array

    def with_terms(self, *terms: LossTerm) -> Linearised:
        """The slopes of some terms of the loss."""
        task = Task(self.task.problem, self.task.window, self.task.handover)
        task.terms = terms
        return linearise(task, self.simulator, self.x, self.scale)

    def moved(self) -> Array:
        """The point moved by each unknown, there and back: (2 n, n)."""
        steps = MOVE * np.diag(self.scale)
        return np.concatenate((self.x + steps, self.x - steps))


@cache
def case(kind: str) -> Case:
    problem = filmed(kind)
    windows, handover = schedule.cut(problem.clock, problem.plan), warm_start.from_fit(problem)
    task = Task(problem, windows[0], handover)
    if kind == "later":
        task = Task(problem, windows[1], task.commit(task.warm_start()).handover)
    scale, rng = task.deviations(), np.random.default_rng(0)
    x = task.warm_start() + 0.3 * scale * rng.normal(size=len(scale))
    return Case(task, simulator(problem, 1), x, scale)


def slope_of(values: Array) -> Array:
    """Central differences (n, ...) of values (2 n, ...) at `Case.moved`."""
    ahead, behind = np.split(values, 2)
    return (ahead - behind) / (2 * MOVE)


@cache
def loss_slopes(kind: str) -> dict[str, Array]:
    """By name the derivative (n,) of each weighted term."""
    here = case(kind)
    values, finite = here.task.evaluate(here.simulator, here.moved())
    assert finite.all()
    return {name: slope_of(value) for name, value in values.items()}


@cache
def residuals(kind: str) -> tuple[Array, Array]:
    """The explicit Jacobian (n, R) of the weighted residuals, and these (R,)."""
    task, rolling, parts = case(kind).task, case(kind).simulator, list[Array]()
    samples = np.concatenate((case(kind).x[None], case(kind).moved()))
    roots = list[Array]()
    for first in range(0, len(samples), rolling.population):
        own = samples[first : first + rolling.population]
        seen = task.seen(rolling.run(task.states(own), task.control(own), task.at_steps))
        terms = [term.residual(seen) for term in task.terms]
        roots = roots or [term.roots() for term in terms]
        weighted = [
            (root * term.vectors).reshape(len(own), -1) for term, root in zip(terms, roots, strict=True)
        ]
        parts.append(np.concatenate(weighted, axis=1))
    rows = np.concatenate(parts)
    return slope_of(rows[1:]), rows[0]


def assert_near(found: Array, expected: Array, tolerance: float) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance * np.abs(expected).max())


def tolerance(kind: str) -> float:
    return 1e-5 if kind == "air" else TOLERANCE


@pytest.mark.parametrize("kind", KINDS)
def test_the_gradient_is_that_of_the_loss(kind: str) -> None:
    here = case(kind)
    found = here.with_terms(*(Sharp(term.weight, term) for term in here.task.terms))
    expected = sum(loss_slopes(kind).values(), np.zeros(len(here.x)))
    assert_near(2 * found.gradient, expected, tolerance(kind))


@pytest.mark.parametrize("kind", ["air", "camera", "moving"])
@pytest.mark.parametrize("name", [term.name for term in TERMS])
def test_the_gradient_of_each_term_is_its_own(kind: str, name: str) -> None:
    terms = [term for term in case(kind).task.terms if term.name == name]
    if not terms:
        assert name == "reprojection"
        return
    if name in ("force", "moment", "borne"):  # see `test_the_gradient_of_what_is_pushed`
        return
    found = case(kind).with_terms(*(Sharp(term.weight, term) for term in terms))
    expected = loss_slopes(kind)[name]
    assert np.abs(expected).max() > 0
    assert_near(2 * found.gradient, expected, tolerance(kind))


@pytest.mark.parametrize("name", ["force", "moment", "borne"])
@pytest.mark.parametrize("kind", ["floor", "later", "camera"])
def test_the_gradient_of_what_is_pushed(kind: str, name: str) -> None:
    here = case(kind)
    (term,) = (term for term in here.task.terms if term.name == name)
    expected = loss_slopes(kind)[name]
    assert np.abs(expected).max() > 0.01
    assert_near(2 * here.with_terms(term).gradient, expected, 8e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_squares_are_those_of_an_explicit_jacobian(kind: str) -> None:
    here, (explicit, residual) = case(kind), residuals(kind)
    found = linearise(here.task, here.simulator, here.x, here.scale)
    assert_near(found.curvature, explicit @ explicit.T, tolerance(kind))
    assert_near(found.gradient, explicit @ residual, tolerance(kind))
    np.testing.assert_allclose(found.curvature, found.curvature.T, rtol=0, atol=1e-5 * found.curvature.max())


@pytest.mark.parametrize("kind", ["floor", "camera"])
def test_the_number_of_threads_changes_no_bit(kind: str) -> None:
    here = case(kind)
    one, *others = (
        linearise(here.task, simulator(here.task.problem, threads), here.x, here.scale)
        for threads in (1, 2, 3)
    )
    for other in others:
        np.testing.assert_array_equal(one.curvature, other.curvature)
        np.testing.assert_array_equal(one.gradient, other.gradient)


def test_an_unknown_of_absurd_slopes_is_left_out() -> None:
    here = case("floor")
    sane = linearise(here.task, here.simulator, here.x, here.scale)
    scale, absurd = here.scale.copy(), [7, len(here.x) - 50]
    scale[absurd] *= 2 * jacobian.JACOBIAN_MAX / np.sqrt(sane.curvature.diagonal()[absurd])
    found = linearise(here.task, here.simulator, here.x, scale)
    assert not found.gradient[absurd].any()
    assert not found.curvature[absurd].any()
    assert not found.curvature[:, absurd].any()
    others = np.setdiff1d(np.arange(len(here.x)), absurd)
    assert_near(found.gradient[others], sane.gradient[others], 1e-5)
    assert_near(found.curvature[np.ix_(others, others)], sane.curvature[np.ix_(others, others)], 1e-5)


def test_the_kinds_are_what_they_are_called() -> None:
    for kind in KINDS:
        here = case(kind)
        free = len(here.x) - here.task.shape[0] * here.task.shape[1]
        assert free == (0 if kind == "later" else 108)
        values, _ = here.task.evaluate(here.simulator, here.x[None])
        assert all(value[0] > 0 for value in values.values())
        assert ("reprojection" in values) is (kind in ("camera", "moving"))


def test_the_ball_is_touched() -> None:
    here = case("ball")
    model, touching = here.task.problem.model, set[str]()
    for state in here.task.commit(here.x).states:
        contact = forward(model, state).contact
        pairs = [{model.geom(int(geom)).name for geom in pair} for pair in contact.geom.reshape(-1, 2)]
        touching |= set().union(*(pair for pair in pairs if "item/ball" in pair))
    assert touching - {"item/ball", "ground"}


def test_differences_of_more_frames_than_there_are_say_nothing(make: type[Makers]) -> None:
    settings = make.settings(population=8)
    settings = replace(settings, loss=replace(settings.loss, total_variation=1.0, landmark=1.0))
    problem = make.clip(settings, make.standing(frames=3))
    (window,) = schedule.cut(problem.clock, problem.plan)
    task = Task(problem, window, warm_start.from_fit(problem))
    found = linearise(task, Simulator(problem.model, 8, 1), task.warm_start(), task.deviations())
    assert np.isfinite(found.curvature).all()
    assert found.gradient.any()
