"""Every term of the registry: its gradient, its curvature, its weight in the plan, and what it needs."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from simrecon import prior
from simrecon.contact import labels
from simrecon.geometry import rotations
from simrecon.kinematics import layout, terms
from simrecon.kinematics.gradient import Gradient
from simrecon.kinematics.hessian import Hessian
from simrecon.kinematics.layout import FREE
from simrecon.kinematics.objective import Objective
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.state import State
from simrecon.kinematics.terms.kept import Hold, Touch, Turn
from simrecon.kinematics.terms.smoothness import Still
from simrecon.kinematics.terms.term import Term
from simrecon.plan import Kinematics
from simrecon.types import Array, ContactTargets, SceneItem
from tests.support.gradients import Function, error

NAMES = [term.name for term in terms.TERMS]
SETTINGS = {
    "shape",
    "poses",
    "ground",
    "temporal",
    "seed_frames",
    "prior_model",
    "contact_model",
    "soles",
    "evaluations",
}
SCALES = {"keypoint_scale_px", "joint_scale_m", "place_scale_m"}


def alone(problem: Problem, term: Term) -> Function:
    """Loss and gradient of one term with a weight of one."""

    def function(x: Array) -> tuple[float, Array]:
        state = State(problem, problem.unpack(x))
        gradient = Gradient(state)
        loss = term.loss(state, gradient, problem.dt if term.per_frame else 1.0)
        return loss, gradient.packed()

    return function


def asked(problem: Problem, name: str) -> Problem:
    """The problem, for terms of wishes with heels that stay, hands that touch, and toes that do not."""
    if not name.startswith("wished"):
        return problem
    parts = problem.observations.labels.parts
    touch, stay, free = np.zeros((3, problem.frames, len(parts)), dtype=np.bool_)
    for column, part in enumerate(parts):
        stay[:, column] = part.endswith("_heel")
        touch[1:, column] = part.endswith(("_heel", "_hand", "_knee"))
        free[:3, column] = part.endswith("_toe")
    targets = ContactTargets(parts, touch, stay, free)
    return replace(problem, observations=replace(problem.observations, targets=targets))


@pytest.mark.parametrize("term", terms.TERMS, ids=NAMES)
def test_gradients_are_those_of_finite_differences(problem: Problem, point: Array, term: Term) -> None:
    problem = asked(problem, term.name)
    assert term.applies(problem)
    assert alone(problem, term)(point)[0] > 1e-6
    assert error(alone(problem, term), point) < 1e-6


@pytest.mark.parametrize("name", ["touch", "hold", "turn"])
def test_gradients_of_a_kept_motion_are_too(problem: Problem, point: Array, name: str) -> None:
    rng, state = np.random.default_rng(4), State(problem, replace(problem.unpack(point), log_scale=0.0))
    points, frames = state.spheres_m.shape[:2]
    near = rng.uniform(0, 0.05, (2, points, frames))
    kept: dict[str, Term] = {
        "touch": Touch(near, rng.uniform(0, 1, near.shape)),
        "hold": Hold(rng.uniform(0, 1, (points, frames - 1))),
        "turn": Turn(state.variables.rotvecs + 0.1),
    }
    assert error(alone(problem, kept[name]), point) < 1e-6


def test_the_check_catches_a_wrong_gradient_of_a_term(problem: Problem, point: Array) -> None:
    class Wrong(Still):
        def loss(self, state: State, gradient: Gradient, unit: float) -> float:
            return super().loss(state, gradient, 1.0001 * unit) / 1.0001

    assert error(alone(problem, Wrong()), point) > 5e-5


def test_the_gradient_by_the_learned_prior_is_too(problem: Problem, point: Array) -> None:
    term = terms.TERMS[NAMES.index("prior")]
    learned = replace(problem, observations=replace(problem.observations, prior=prior.flow()))
    assert alone(learned, term)(point)[0] != pytest.approx(alone(problem, term)(point)[0])
    assert error(alone(learned, term), point) < 1e-6


def test_the_plan_has_a_weight_for_each_term_and_for_no_other() -> None:
    weights = {field.name for field in fields(Kinematics)} - SETTINGS - SCALES
    assert {term.name for term in terms.PLANNED} == weights
    assert len(set(NAMES)) == len(NAMES)


@pytest.mark.parametrize("term", terms.PLANNED, ids=lambda term: term.name)
def test_a_term_can_be_switched_off_and_be_the_only_one(problem: Problem, point: Array, term: Term) -> None:
    full, off, only = (
        Objective(replace(problem, plan=plan))
        for plan in (
            problem.plan,
            terms.without(problem.plan, (term,)),
            terms.only(problem.plan, (term.name,)),
        )
    )
    losses = [objective(point)[0] for objective in (full, off, only)]
    assert losses[0] - losses[1] == pytest.approx(full.losses[term.name], rel=1e-6)
    assert off.losses.get(term.name, 0.0) == 0.0
    others = {name for name, loss in only.losses.items() if loss} - {term.name}
    assert others == {"shared", "lengths", "lean"}


def test_letters_of_the_ablation_switch_what_they_name(problem: Problem) -> None:
    weights = problem.plan

    def off(plan: Kinematics) -> set[str]:
        return {term.name for term in terms.PLANNED if not term.weight(plan)}

    floor = {"penetration", "contact", "balance"}
    over_time = {
        "still",
        "smooth_position",
        "travel_position",
        "smooth_com",
        "smooth_rotation",
        "travel_rotation",
    }
    assert terms.switched(weights) == weights
    assert off(terms.floating(weights)) == off(terms.switched(replace(weights, ground=False))) == floor
    off_in_time = off(terms.switched(replace(weights, temporal=False)))
    assert over_time <= off_in_time
    assert off_in_time.isdisjoint({"keypoint", "joint", "place", "limit", "prior", *floor})
    assert off(terms.switched(replace(weights, ground=False, temporal=False))) == floor | off_in_time


def test_hips_at_rest_on_a_seat_need_no_balance_over_the_feet(problem: Problem, point: Array) -> None:
    """The pelvis of the fixture is half a metre over the step; a block of that height is a seat."""
    pelvis = problem.unpack(point).root_m.mean(axis=0)
    size = (1.0, 1.0, float(pelvis[2]) - 0.1)
    seat = SceneItem("seat", "box", (float(pelvis[0]), float(pelvis[1]), 0.0), {"size_m": size})

    def balance(sitting: float) -> float:
        known = problem.observations.standing
        resting = labels.of_feet_and_hips(known, np.full(problem.frames, sitting), "test")
        see = replace(problem.observations, labels=resting)
        seated = replace(problem, scene=replace(problem.scene, items=(seat,)), observations=see)
        objective = Objective(replace(seated, plan=terms.only(seated.plan, ("balance",))))
        assert error(objective, point) < 1e-6
        return objective.losses["balance"]

    assert balance(1.0) < 0.3 * balance(0.0)


SQUARED = {"smooth_com", "smooth_position", "smooth_rotation", "limit", "prior", "penetration"}
SQUARED |= {"wished_stay", "wished_free"}
EXACT = SQUARED | {"shared", "lengths", "lean"}
EVIDENCE = ("keypoint", "joint", "place")
ON_ROTATIONS = {"limit", "smooth_rotation", "travel_rotation", "prior"}


def direction(problem: Problem, name: str, size: int, rng: np.random.Generator) -> Array:
    """A random step in unknowns in which the residuals of a term are linear."""
    step = np.zeros(size)
    root, rotvecs, shared = layout.split(step, problem.frames)
    if name in ON_ROTATIONS:
        rotvecs[1:] = rng.normal(size=rotvecs[1:].shape)
    elif name in ("shared", "lengths", "lean"):
        shared[:] = rng.normal(size=shared.shape)
    else:
        root[:] = rng.normal(size=root.shape)
    return step


def bent(problem: Problem, term: Term, x: Array, step: Array) -> float:
    """Second derivative along a step by the curvature of a term with a weight of one."""
    frames, state = problem.frames, State(problem, problem.unpack(x))
    own, shared = layout.by_frame(step, frames)
    own, total = own.reshape(frames, FREE), 0.0
    hessian, nothing = Hessian(state), Hessian(state)
    nothing.prior = 0.0 if term.name == "prior" else nothing.prior  # the term is instead of the least prior
    term.curvature(state, hessian, 1.0)
    for sign, part in ((1, hessian.by_variables(slice(None))), (-1, nothing.by_variables(slice(None)))):
        total += sign * 2 * np.einsum("ti,tij,j->", own, part.wide(), shared)
        total += sign * shared @ part.corner @ shared
        for k, block in enumerate(part.blocks):
            pairs = np.einsum("ti,tij,tj->", own[k:], block[: frames - k], own[: frames - k])
            total += sign * (2 if k else 1) * pairs
    return float(total)


def slope(function: Function, x: Array, step: Array) -> float:
    """Second derivative along a step by differences of the gradient."""
    return float((function(x + 1e-5 * step)[1] - function(x - 1e-5 * step)[1]) @ step / 2e-5)


@pytest.mark.parametrize("name", [name for name in NAMES if name != "joint"])
def test_curvatures_are_those_of_the_terms(problem: Problem, point: Array, name: str) -> None:
    """Exact where residuals are squared, over the ground alone; where they are robust, a bound from above."""
    term, rng = terms.TERMS[NAMES.index(name)], np.random.default_rng(12)
    problem = asked(replace(problem, scene=replace(problem.scene, items=())), name)
    for _ in range(5):
        step = direction(problem, name, len(point), rng)
        own, true = bent(problem, term, point, step), slope(alone(problem, term), point, step)
        if name in EXACT:
            assert own == pytest.approx(true, rel=1e-3)
        else:
            assert own > max(true, 0.0)


@pytest.mark.parametrize("name", EVIDENCE)
def test_curvatures_are_exact_where_evidence_agrees(problem: Problem, point: Array, name: str) -> None:
    """By all unknowns: without a residual the approximation of Gauss and Newton is none."""
    state = State(problem, problem.unpack(point))
    back = np.swapaxes(rotations.matrix(rotations.exp(state.lean_rad)), -1, -2)  # (T, 3, 3)
    relative = (state.landmarks_m - state.hips_m)[..., None] / state.scale
    camera = problem.observations.world_to_camera
    assert camera is not None
    xyz = (camera[:, :3, :3] @ state.landmarks_m[..., None])[..., 0] + camera[:, :3, 3]
    agreeing = replace(
        problem.observations,
        rays=xyz[..., :2] / xyz[..., 2:],
        joints_m=(back @ relative)[..., 0],
        place_m=state.hips_m,
    )
    clean, term = replace(problem, observations=agreeing), terms.TERMS[NAMES.index(name)]
    assert alone(clean, term)(point)[0] < 1e-12
    rng = np.random.default_rng(13)
    for _ in range(5):
        step = 0.1 * rng.normal(size=len(point))
        own = bent(clean, term, point, step)
        assert own == pytest.approx(slope(alone(clean, term), point, step), rel=1e-3)
