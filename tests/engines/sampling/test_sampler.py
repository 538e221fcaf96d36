"""Trajectory optimisation by sampling: recovery, same bits everywhere, exact hand-over, failure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon import kinematics, schedule
from simrecon.engines import warm_start
from simrecon.engines.problem import Problem
from simrecon.engines.sampling.descent import Descent
from simrecon.engines.sampling.sampler import Sampler
from simrecon.engines.sampling.search import PATIENCE, Search
from simrecon.engines.sampling.task import Task
from simrecon.geometry import splines
from simrecon.plan import Plan
from simrecon.sim.state import initial_state, qpos_of, simulate
from simrecon.types import Array, Handover, KinematicFit, WindowResult, WindowStatus
from tests.engines.conftest import Makers


def solve(problem: Problem, plan: Plan, *, threads: int = 1, seed: int = 0) -> list[WindowResult]:
    sampler, handover = Sampler(problem, threads), warm_start.from_fit(problem)
    rng, results = np.random.default_rng(seed), []
    for window in schedule.cut(problem.clock, plan):
        results.append(sampler.solve(window, handover, rng))
        handover = results[-1].handover
    return results


def as_simulated(problem: Problem, fit: KinematicFit, knots: Array) -> Problem:
    """The same problem, but what has to be tracked is what the simulator does under the knots."""
    clock, spacing = problem.clock, problem.plan.window.knot_spacing_s
    times_s = np.arange(clock.steps, dtype=float) * clock.step_s
    ctrl = problem.targets_rad[:-1] + splines.basis(times_s, spacing, len(knots)) @ knots
    states = simulate(problem.model, warm_start.from_fit(problem).state, ctrl)
    qpos = qpos_of(problem.model, states)[:: clock.stride]
    com, points = kinematics.configurations(fit.body, qpos)
    return replace(problem, orientations=qpos[:, 3:].reshape(len(qpos), 17, 4), com_m=com, points_m=points)


def test_known_knots_are_recovered(make: type[Makers]) -> None:
    plan = make.settings(population=24, generations=300)
    fit = make.standing(frames=7)
    problem = make.clip(plan, fit)
    start = warm_start.from_fit(problem)
    truth = np.random.default_rng(5).uniform(-0.3, 0.3, problem.draft_rad.shape)
    problem = as_simulated(problem, fit, truth)
    (window,) = schedule.cut(problem.clock, plan)
    # under the true knots nothing is left of the loss (arccos keeps half of the digits)
    exact = Task(problem, window, start)
    terms, finite = exact.evaluate(
        Sampler(problem, 1).simulator, np.stack([truth.ravel(), 0 * truth.ravel()])
    )
    total = sum(terms.values(), np.zeros(2))
    assert finite.all()
    assert total[0] < 1e-4 < 0.05 < total[1]
    (result,) = solve(problem, plan)
    assert result.trace[0] <= total[1]
    assert result.loss < 0.35 * total[1]
    assert (np.diff(result.trace) <= 0).all()
    assert result.loss == pytest.approx(sum(result.loss_terms.values()))
    assert result.status is WindowStatus.GENERATIONS
    # the start, and the mean at the end
    assert (result.evaluations, len(result.trace)) == (1 + 24 * 300 + 1, 1 + 300)
    assert 0 < result.stepping_s <= result.seconds


@pytest.fixture(scope="module")
def plan(make: type[Makers]) -> Plan:
    return make.settings(
        length_s=0.2,
        overlap_s=0.1,
        population=8,
        generations=3,
        prior=0.05,
        total_variation=1.0,
        joint_limit=1.0,
    )


@pytest.fixture(scope="module")
def problem(make: type[Makers], plan: Plan) -> Problem:
    return make.clip(plan)


@pytest.fixture(scope="module")
def results(problem: Problem, plan: Plan) -> list[WindowResult]:
    return solve(problem, plan)


def test_the_number_of_threads_does_not_matter(
    problem: Problem, plan: Plan, results: list[WindowResult]
) -> None:
    for one, two in zip(results, solve(problem, plan, threads=2), strict=True):
        np.testing.assert_array_equal(one.ctrl, two.ctrl)
        np.testing.assert_array_equal(one.states, two.states)
        np.testing.assert_array_equal(one.trace, two.trace)
        assert one.loss_terms == two.loss_terms
    other = solve(problem, plan, seed=1)
    assert not np.array_equal(results[0].ctrl, other[0].ctrl)


def test_windows_hand_over_exactly(problem: Problem, plan: Plan, results: list[WindowResult]) -> None:
    windows = schedule.cut(problem.clock, plan)
    assert len(results) == len(windows) == 3
    ctrl = schedule.stitch(tuple(results))
    assert ctrl.shape == (problem.clock.steps, 48)
    states = simulate(problem.model, warm_start.from_fit(problem).state, ctrl)
    for window, result in zip(windows, results, strict=True):
        assert result.window == window
        np.testing.assert_array_equal(result.states, states[window.start_step : window.commit_step + 1])
        np.testing.assert_array_equal(result.handover.state, states[window.commit_step])


def test_the_control_is_a_spline_about_the_kinematic_targets(
    problem: Problem, plan: Plan, results: list[WindowResult]
) -> None:
    knots = results[0].handover.knots_rad
    assert results[0].handover.first == 0
    steps = results[0].window.commit_step
    times_s = np.arange(steps, dtype=float) * problem.clock.step_s
    added = splines.basis(times_s, plan.window.knot_spacing_s, len(knots)) @ knots
    np.testing.assert_allclose(results[0].ctrl, problem.targets_rad[:steps] + added, atol=1e-12)
    assert np.abs(added).max() > 1e-3
    assert np.abs(knots).max() <= plan.optimiser.bound_rad


def test_a_window_is_never_worse_than_the_kinematic_targets_alone(
    problem: Problem, plan: Plan, results: list[WindowResult]
) -> None:
    window = schedule.cut(problem.clock, plan)[0]
    task = Task(problem, window, warm_start.from_fit(problem))
    terms, _ = task.evaluate(Sampler(problem, 1).simulator, np.zeros((1, len(task.warm_start()))))
    assert results[0].trace[0] <= sum(terms.values(), np.zeros(1))[0] * (1 + 1e-9)


def test_terms_that_are_switched_off_are_left_out(results: list[WindowResult]) -> None:
    assert set(results[0].loss_terms) == {
        *("com_position", "com_velocity", "pose", "prior", "total_variation", "joint_limit"),
    }


def test_a_window_in_which_everything_diverges_fails(problem: Problem, plan: Plan) -> None:
    start = warm_start.from_fit(problem)
    velocity = np.zeros(problem.model.nv)
    velocity[6:] = 1e12
    wild = initial_state(problem.model, problem.qpos[0], velocity)
    window = schedule.cut(problem.clock, plan)[0]
    sampler = Sampler(problem, 1)
    failed = sampler.solve(window, Handover(wild, start.knots_rad), np.random.default_rng(0))
    assert failed.status is WindowStatus.FAILED
    assert failed.loss == np.inf
    assert failed.loss_terms == {}
    assert np.isinf(failed.trace).all()
    # and the same sampler goes on with a sane state
    assert sampler.solve(window, start, np.random.default_rng(0)).status is WindowStatus.GENERATIONS


def test_a_window_ends_when_its_loss_is_at_rest(make: type[Makers]) -> None:
    plan = make.settings(population=4, generations=60)
    strict, lenient = (
        replace(plan, optimiser=replace(plan.optimiser, tol_loss=tolerance)) for tolerance in (0.0, 0.5)
    )
    problem = make.clip(strict, make.standing(frames=3))
    (whole,) = solve(problem, strict)
    assert (whole.status, len(whole.trace)) == (WindowStatus.GENERATIONS, 61)
    (ended,) = solve(replace(problem, plan=lenient), lenient)
    assert ended.status is WindowStatus.AT_REST
    count = len(ended.trace)
    np.testing.assert_array_equal(ended.trace[:-1], whole.trace[: count - 1])
    improved = whole.trace[:-PATIENCE] - whole.trace[PATIENCE:]  # over ten generations
    first = int(np.argmax(improved <= 0.5 * whole.trace[PATIENCE:]))
    assert count == first + PATIENCE + 1


def test_a_window_ends_when_its_steps_are_small(make: type[Makers]) -> None:
    plan = make.settings(population=8, generations=200)
    plan = replace(plan, optimiser=replace(plan.optimiser, tol_sigma=0.95))
    (result,) = solve(make.clip(plan, make.standing(frames=3)), plan)
    assert result.status is WindowStatus.SMALL_STEPS
    assert 2 < len(result.trace) < 200


def test_descent_steps_lead_where_many_generations_do_not(make: type[Makers]) -> None:
    plan = make.settings(population=24, generations=0, descent=4)
    fit = make.standing(frames=7)
    problem = make.clip(plan, fit)
    truth = np.random.default_rng(5).uniform(-0.3, 0.3, problem.draft_rad.shape)
    problem = as_simulated(problem, fit, truth)
    (result,) = solve(problem, plan)
    assert result.descent_steps == 8
    assert len(result.trace) == 9
    assert (np.diff(result.trace) <= 0).all()
    assert result.loss < 0.15 * result.trace[0]


def test_samples_after_a_descent_are_spread_for_the_rise_of_the_plan(make: type[Makers]) -> None:
    plan = make.settings(population=24, generations=1, descent=1, start=0.02)
    problem = make.clip(plan)
    (window,) = schedule.cut(problem.clock, plan)
    sampler = Sampler(problem, 1)
    before = Task(problem, window, warm_start.from_fit(problem))
    descent = Descent.begin(before, sampler.simulator, before.warm_start()[None])
    descent.step()
    assert 0 < descent.gain < 1
    rises = {}
    for spread in (0.1, 1.0):
        task = Task(
            replace(problem, plan=replace(plan, optimiser=replace(plan.optimiser, spread=spread))),
            window,
            warm_start.from_fit(problem),
        )
        search = Search(replace(descent, task=task), np.random.default_rng(0))
        rises[spread] = float(np.median(search.consider(search.es.ask()))) / descent.loss - 1.0
    assert 0 < rises[0.1] < 0.5 * rises[1.0]
    assert rises[1.0] < 10.0


def test_the_first_state_may_be_free(make: type[Makers]) -> None:
    plan = make.settings(length_s=0.2, overlap_s=0.1, population=8, generations=3, start=0.005)
    problem = make.clip(plan)
    kinematic = warm_start.from_fit(problem).state
    results = solve(problem, plan)
    assert np.abs(results[0].states[0] - kinematic).max() > 1e-3
    np.testing.assert_array_equal(results[1].states[0], results[0].states[-1])
    before, after = (qpos_of(problem.model, state) for state in (kinematic, results[0].states[0]))
    assert 0 < np.abs(after - before).max() < 0.3
    quats = after[3:].reshape(17, 4)
    np.testing.assert_allclose(np.linalg.norm(quats, axis=1), 1.0, atol=1e-12)
    states = simulate(problem.model, results[0].states[0], schedule.stitch(tuple(results)))
    np.testing.assert_array_equal(states[-1], results[-1].states[-1])
