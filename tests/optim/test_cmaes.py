"""CMA-ES: as fast as the reference implementation, resumable to the bit, and robust to bad losses."""

from __future__ import annotations

import importlib
import json
import time
import tracemalloc
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from simrecon.optim import covariance as covariances
from simrecon.optim.cmaes import CMAES, Covariance, strategy
from simrecon.types import Array

Function = Callable[[Array], Array]
COVARIANCES: tuple[Covariance, ...] = ("diagonal", "low_rank", "full")
TARGET = 1e-8


def sphere(x: Array) -> Array:
    return np.square(x).sum(axis=-1)


def ellipsoid(x: Array) -> Array:
    return np.square(x) @ np.geomspace(1.0, 1e6, x.shape[-1])


def rosenbrock(x: Array) -> Array:
    return (100 * (x[..., 1:] - x[..., :-1] ** 2) ** 2 + (1 - x[..., :-1]) ** 2).sum(axis=-1)


def generations(run: CMAES, function: Function, count: int) -> CMAES:
    for _ in range(count):
        samples = run.ask()
        run.tell(samples, function(samples))
    return run


def evaluations_to_target(
    function: Function, x0: Array, sigma: float, covariance: Covariance, seed: int
) -> float:
    run = CMAES(x0, sigma, covariance=covariance, rng=seed)
    while run.best_loss > TARGET and run.generation < 3000:
        generations(run, function, 1)
    return run.evaluations if run.best_loss <= TARGET else np.inf


def reference_evaluations(
    package: Any, function: Function, x0: Array, sigma: float, covariance: Covariance, seed: int
) -> float:
    population = 4 + int(3 * np.log(x0.size))
    options = {
        "popsize": population,
        "CMA_diagonal": covariance == "diagonal",
        "seed": seed + 1,
        "verbose": -9,
    }
    options |= {"verb_log": 0, "tolfun": 0, "tolx": 0}
    run = package.CMAEvolutionStrategy(x0, sigma, options)
    for generation in range(3000):
        samples = run.ask()
        losses = function(np.array(samples))
        run.tell(samples, losses.tolist())
        if losses.min() <= TARGET:
            return (generation + 1) * population
    return np.inf


@pytest.mark.parametrize(
    ("function", "covariance", "fastest"),
    [
        (sphere, "full", 0.85),
        (ellipsoid, "full", 0.85),
        (rosenbrock, "full", 0.85),
        (sphere, "diagonal", 0.85),
        # Stronger negative weights than the reference takes here (see `Diagonal.update`).
        (ellipsoid, "diagonal", 0.75),
    ],
)
def test_as_many_evaluations_as_the_reference(
    function: Function, covariance: Covariance, fastest: float
) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        package = pytest.importorskip("cma")
        x0, sigma = (np.zeros(10), 0.3) if function is rosenbrock else (np.ones(10), 0.5)
        reference = [
            reference_evaluations(package, function, x0, sigma, covariance, seed) for seed in range(11)
        ]
    own = [evaluations_to_target(function, x0, sigma, covariance, seed) for seed in range(31)]
    assert fastest <= np.median(own) / np.median(reference) <= 1.15


@pytest.mark.parametrize("covariance", COVARIANCES)
def test_same_seed_same_bits(covariance: Covariance) -> None:
    a, b = (generations(CMAES(np.ones(6), 0.5, covariance=covariance, rng=4), sphere, 20) for _ in range(2))
    other = generations(CMAES(np.ones(6), 0.5, covariance=covariance, rng=5), sphere, 20)
    assert a.mean.tobytes() == b.mean.tobytes()
    assert a.standard_deviations.tobytes() == b.standard_deviations.tobytes()
    assert a.mean.tobytes() != other.mean.tobytes()


@pytest.mark.parametrize("covariance", COVARIANCES)
@pytest.mark.parametrize("n", [1, 2, 40])
@pytest.mark.parametrize("pause", ["before ask", "before tell"])
def test_resumed_run_has_the_same_bits(covariance: Covariance, n: int, pause: str, tmp_path: Any) -> None:
    scales = np.linspace(0.5, 2.0, n)
    bounds = np.tile([0.9, np.inf], (n, 1))
    run = CMAES(np.ones(n), 0.5, scales=scales, covariance=covariance, bounds=bounds, rng=1)
    generations(run, ellipsoid, 13)
    samples = run.ask() if pause == "before tell" else np.empty(0)
    np.savez(tmp_path / "state.npz", allow_pickle=False, **run.state())
    with np.load(tmp_path / "state.npz", allow_pickle=False) as state:
        resumed = CMAES.from_state(state)
    for one in (run, resumed):
        if samples.size:
            one.tell(samples, ellipsoid(samples))
        generations(one, ellipsoid, 17)
    assert run.mean.tobytes() == resumed.mean.tobytes()
    assert run.standard_deviations.tobytes() == resumed.standard_deviations.tobytes()
    assert run.best_x.tobytes() == resumed.best_x.tobytes()
    assert run.history.tobytes() == resumed.history.tobytes()
    assert (run.sigma, run.best_loss, run.evaluations) == (
        resumed.sigma,
        resumed.best_loss,
        resumed.evaluations,
    )
    assert run.ask().tobytes() == resumed.ask().tobytes()


@pytest.mark.parametrize("name", ["PCG64", "PCG64DXSM", "Philox", "SFC64", "MT19937"])
def test_state_goes_through_json_with_every_bit_generator(name: str) -> None:
    rng = np.random.Generator(getattr(np.random, name)(3))
    run = generations(CMAES(np.ones(3), 0.5, covariance="full", rng=rng), sphere, 7)
    text = json.dumps(run.state(), default=lambda array: array.tolist())
    assert CMAES.from_state(json.loads(text)).ask().tobytes() == run.ask().tobytes()


def test_state_is_a_copy() -> None:
    run = CMAES(np.ones(3), 0.5, rng=0)
    state = run.state()
    before = json.dumps(state, default=lambda array: array.tolist())
    generations(run, sphere, 5)
    assert json.dumps(state, default=lambda array: array.tolist()) == before


def test_foreign_states_are_errors() -> None:
    state = CMAES(np.ones(3), 0.5, rng=0).state()
    with pytest.raises(ValueError, match="schema"):
        CMAES.from_state({**state, "schema": "other/1"})
    with pytest.raises(ValueError, match="schema"):
        CMAES.from_state({})
    with pytest.raises(ValueError, match="bit generator 'seed'"):
        CMAES.from_state({**state, "rng": '{"bit_generator": "seed"}'})


@pytest.mark.parametrize("covariance", COVARIANCES)
def test_only_the_order_of_the_losses_counts(covariance: Covariance) -> None:
    plain = generations(CMAES(np.ones(8), 0.5, covariance=covariance, rng=2), ellipsoid, 60)
    bent = CMAES(np.ones(8), 0.5, covariance=covariance, rng=2)
    generations(bent, lambda x: np.log(ellipsoid(x)) ** 3 - 7.0, 60)
    assert plain.mean.tobytes() == bent.mean.tobytes()
    assert plain.sigma == bent.sigma


@pytest.mark.parametrize("covariance", COVARIANCES)
def test_order_of_the_samples_does_not_count(covariance: Covariance) -> None:
    a, b = (CMAES(np.ones(8), 0.5, covariance=covariance, rng=2) for _ in range(2))
    for seed in range(20):
        samples, again = a.ask(), b.ask()
        shuffled = again[np.random.default_rng(seed).permutation(a.population)]
        a.tell(samples, sphere(samples))
        b.tell(shuffled, sphere(shuffled))
    np.testing.assert_array_equal(a.mean, b.mean)


@pytest.mark.parametrize("covariance", COVARIANCES)
def test_arguments_and_results_are_not_shared(covariance: Covariance) -> None:
    mean, scales, bounds = np.ones(5), np.ones(5), np.tile([-9.0, 9.0], (5, 1))
    run = CMAES(mean, 0.5, scales=scales, covariance=covariance, bounds=bounds, rng=0)
    samples = run.ask()
    losses = -sphere(samples)
    losses[3] = np.nan
    kept = [array.copy() for array in (mean, scales, bounds, samples, losses)]
    run.tell(samples, losses)
    for array, copy in zip((mean, scales, bounds, samples, losses), kept, strict=True):
        np.testing.assert_array_equal(array, copy)
    before = run.ask().shape, run.mean.copy(), run.best_x.copy(), run.standard_deviations.copy()
    for array in (mean, samples, run.mean, run.best_x, run.standard_deviations):
        array[:] = 1e6
    np.testing.assert_array_equal(run.mean, before[1])
    np.testing.assert_array_equal(run.best_x, before[2])
    np.testing.assert_array_equal(run.standard_deviations, before[3])


@pytest.mark.parametrize("covariance", COVARIANCES)
def test_bounds_hold_and_a_minimum_on_them_is_found(covariance: Covariance) -> None:
    bounds = np.array([[1.0, 4.0], [-np.inf, -2.0], [-1.0, np.inf], [-0.01, 0.01], [-np.inf, np.inf]])
    run = CMAES(np.array([3.0, -5.0, 2.0, 0.0, 1.0]), 1.5, covariance=covariance, bounds=bounds, rng=3)
    for _ in range(350):
        samples = run.ask()
        assert ((bounds[:, 0] <= samples) & (samples <= bounds[:, 1])).all()
        assert ((bounds[:, 0] <= run.mean) & (run.mean <= bounds[:, 1])).all()
        run.tell(samples, sphere(samples))
    np.testing.assert_allclose(run.mean, [1.0, -2.0, 0.0, 0.0, 0.0], atol=1e-4)


@pytest.mark.parametrize("covariance", COVARIANCES)
def test_box_that_is_narrow_in_some_directions_of_a_rotated_ellipsoid(covariance: Covariance) -> None:
    rotation, _ = np.linalg.qr(np.random.default_rng(7).standard_normal((6, 6)))
    hessian = (rotation * np.geomspace(1.0, 1e3, 6)) @ rotation.T
    bounds = np.array([[-5, 5], [0.5, 5], [1, 1.001], [-5, 5], [0.5, np.inf], [-np.inf, -1]])
    start = np.array([2.0, 2.0, 1.0, 2.0, 2.0, -2.0])

    def loss(x: Array) -> Array:
        return np.einsum("...i,ij,...j->...", x, hessian, x)

    known = lsq_linear(np.linalg.cholesky(hessian).T, np.zeros(6), bounds.T, tol=1e-12)
    run = CMAES(start, 1.0, covariance=covariance, bounds=bounds, rng=2)
    generations(run, loss, 1000)
    assert run.best_loss == pytest.approx(2 * known.cost, rel=1e-4)


def test_bounded_samples_may_be_told_in_any_order_and_may_be_foreign() -> None:
    bounds = np.tile([-1.0, 1.5], (4, 1))
    a, b = (CMAES(np.ones(4), 1.0, covariance="full", bounds=bounds, rng=0) for _ in range(2))
    for seed in range(10):
        samples = a.ask()
        shuffled = b.ask()[np.random.default_rng(seed).permutation(b.population)]
        a.tell(samples, rosenbrock(samples))
        b.tell(shuffled, rosenbrock(shuffled))
    assert a.mean.tobytes() == b.mean.tobytes()
    b.tell(np.zeros((b.population, 4)), np.arange(b.population))
    np.testing.assert_allclose(b.mean, 0.0, atol=1e-12)


def test_scales_fit_the_box() -> None:
    run = CMAES(np.zeros(2), 2.0, bounds=np.array([[-1.0, 1.0], [0.0, np.inf]]), rng=0)
    np.testing.assert_allclose(run.standard_deviations, [0.5, 2.0])


def test_bounds_that_are_far_change_nothing() -> None:
    free = generations(CMAES(np.ones(5), 0.5, rng=3), sphere, 30)
    bound = generations(CMAES(np.ones(5), 0.5, bounds=np.tile([-1e9, 1e9], (5, 1)), rng=3), sphere, 30)
    np.testing.assert_array_equal(free.mean, bound.mean)


@pytest.mark.parametrize("covariance", COVARIANCES)
def test_infinite_and_nan_losses_rank_last(covariance: Covariance) -> None:
    def half_lost(bad: float) -> Function:
        return lambda x: np.where(x[:, 0] > 1.0, bad, sphere(x))

    infinite, nan, large = (
        generations(CMAES(np.ones(6), 0.5, covariance=covariance, rng=1), half_lost(bad), 200)
        for bad in (np.inf, np.nan, 1e300)
    )
    assert infinite.mean.tobytes() == nan.mean.tobytes() == large.mean.tobytes()
    assert infinite.best_loss < 1e-6


@pytest.mark.parametrize("covariance", COVARIANCES)
def test_generation_without_a_finite_loss_teaches_nothing(covariance: Covariance) -> None:
    run = CMAES(np.ones(4), 0.5, covariance=covariance, rng=1)
    generations(run, lambda x: np.full(len(x), np.nan), 3)
    np.testing.assert_array_equal(run.mean, np.ones(4))
    np.testing.assert_array_equal(run.best_x, np.ones(4))
    assert (run.sigma, run.best_loss, run.generation, run.evaluations) == (0.5, np.inf, 3, 3 * run.population)
    assert generations(run, sphere, 150).best_loss < 1e-6


def test_best_is_the_best_sample_ever_told() -> None:
    run = CMAES(np.ones(3), 0.5, rng=1)
    told = []
    for _ in range(30):
        samples = run.ask()
        run.tell(samples, rosenbrock(samples))
        told.append(samples)
    everything = np.concatenate(told)
    best = rosenbrock(everything).argmin()
    np.testing.assert_array_equal(run.best_x, everything[best])
    assert run.best_loss == rosenbrock(everything)[best]
    np.testing.assert_array_equal(run.history, [rosenbrock(samples).min() for samples in told])


@pytest.mark.parametrize("covariance", COVARIANCES)
@pytest.mark.parametrize(("n", "population"), [(1, 2), (2, 3), (3, 200), (60, 5), (30, None)])
def test_covariance_stays_positive(covariance: Covariance, n: int, population: int | None) -> None:
    run = CMAES(np.ones(n), 0.5, population=population, covariance=covariance, rng=1)
    rng = np.random.default_rng(0)
    for generation in range(300):
        # The worst for negative weights: bad losses concentrate on one axis, or mean nothing at all.
        samples = run.ask()
        run.tell(samples, np.abs(samples[:, 0]) if generation < 150 else rng.random(run.population))
        assert (run.standard_deviations > 0).all()
        assert np.isfinite(run.standard_deviations).all()
        if covariance == "full":
            matrix = np.asarray(run.state()["matrix"])
            assert np.linalg.eigvalsh(matrix)[0] > 0
            np.testing.assert_array_equal(matrix, matrix.T)


@pytest.mark.parametrize("covariance", COVARIANCES)
def test_run_that_goes_on_after_it_converged_stays_finite(covariance: Covariance) -> None:
    run = generations(
        CMAES(np.ones(2), 0.5, covariance=covariance, rng=1), lambda x: sphere(x - 1.0 / 3.0), 6000
    )
    np.testing.assert_allclose(run.mean, 1.0 / 3.0, atol=1e-7)
    assert np.isfinite(run.standard_deviations).all()
    assert run.sigma > 0


@pytest.mark.parametrize("covariance", COVARIANCES)
def test_scales_are_the_initial_deviations(covariance: Covariance) -> None:
    scales = np.array([1e-3, 1.0, 50.0])
    run = CMAES(np.array([1.0, 2.0, 3.0]), 0.2, scales=scales, population=4000, covariance=covariance, rng=0)
    np.testing.assert_allclose(run.standard_deviations, 0.2 * scales)
    np.testing.assert_allclose(run.ask().std(axis=0), 0.2 * scales, rtol=0.05)


@pytest.mark.parametrize("covariance", COVARIANCES)
def test_scales_and_units_are_the_same_thing(covariance: Covariance) -> None:
    scales = 2.0 ** np.arange(-3, 3)
    plain = generations(CMAES(np.ones(6), 0.5, covariance=covariance, rng=0), rosenbrock, 50)
    scaled = CMAES(scales, 0.5, scales=scales, covariance=covariance, rng=0)
    generations(scaled, lambda x: rosenbrock(x / scales), 50)
    np.testing.assert_allclose(scaled.mean / scales, plain.mean, rtol=1e-9)


def test_full_covariance_learns_the_inverse_hessian() -> None:
    rotation, _ = np.linalg.qr(np.random.default_rng(7).standard_normal((4, 4)))
    hessian = (rotation * [1.0, 10.0, 100.0, 1000.0]) @ rotation.T
    run = CMAES(np.ones(4), 0.5, covariance="full", rng=0)
    generations(run, lambda x: np.einsum("pi,ij,pj->p", x, hessian, x), 150)
    product = np.asarray(run.state()["matrix"]) @ hessian
    spread = np.linalg.eigvals(product).real
    assert spread.max() / spread.min() < 5.0


def test_convergence_needs_both_loss_and_step_at_rest() -> None:
    run = CMAES(np.ones(5), 0.5, rng=0)
    generations(run, sphere, 40)
    assert not run.converged(1e-9, 1e-4)
    before = json.dumps(run.state(), default=lambda array: array.tolist())
    assert run.converged(np.inf, np.inf, generations=40)
    assert not run.converged(np.inf, np.inf, generations=41)
    assert not run.converged(np.inf, 1e-4, generations=5)
    assert not run.converged(1e-9, np.inf, generations=5)
    assert json.dumps(run.state(), default=lambda array: array.tolist()) == before
    generations(run, sphere, 160)
    assert run.converged(1e-9, 1e-4)
    generations(run, lambda x: np.full(len(x), np.inf), 1)
    assert not run.converged(1e-9, 1e-4)


@pytest.mark.parametrize(("n", "population"), [(1, 2), (10, 10), (10, 11), (400, 64)])
@pytest.mark.parametrize("covariance", COVARIANCES)
def test_constants_are_consistent(n: int, population: int, covariance: Covariance) -> None:
    constants = strategy(n, population, covariance)
    weights = constants.weights
    assert weights.shape == (population,)
    assert (np.diff(weights) < 0).all()
    assert weights[: constants.mu].sum() == pytest.approx(1.0)
    assert 1 / np.square(weights[: constants.mu]).sum() == pytest.approx(constants.mu_eff)
    assert constants.c_1 + constants.c_mu <= 1
    if covariance == "full":
        assert (
            -weights[weights < 0].sum() <= (1 - constants.c_1 - constants.c_mu) / (n * constants.c_mu) + 1e-12
        )


def naive_step(
    mean: Array, sigma: float, matrix: Array, paths: tuple[Array, Array], samples: Array, generation: int
) -> tuple[Array, float, Array, tuple[Array, Array], bool]:
    """Eq. 41 to 47 of the tutorial, one term at a time; samples are ranked."""
    n, k = mean.size, strategy(mean.size, len(samples), "full")
    values, basis = np.linalg.eigh(matrix)
    inverse_root = basis @ np.diag(values**-0.5) @ basis.T
    steps = [(x - mean) / sigma for x in samples]
    average = sum(w * y for w, y in zip(k.weights, steps, strict=True) if w > 0)
    path_sigma = (1 - k.c_sigma) * paths[0]
    path_sigma = path_sigma + (k.c_sigma * (2 - k.c_sigma) * k.mu_eff) ** 0.5 * inverse_root @ average
    length = np.linalg.norm(path_sigma)
    quiet = length / (1 - (1 - k.c_sigma) ** (2 * generation)) ** 0.5 < (1.4 + 2 / (n + 1)) * k.chi_n
    path_c = (1 - k.c_c) * paths[1] + quiet * (k.c_c * (2 - k.c_c) * k.mu_eff) ** 0.5 * average
    keep = 1 + k.c_1 * (not quiet) * k.c_c * (2 - k.c_c) - k.c_1 - k.c_mu * k.weights.sum()
    new = keep * matrix + k.c_1 * np.outer(path_c, path_c)
    for w, y in zip(k.weights, steps, strict=True):
        rescaled = w if w >= 0 else w * n / np.linalg.norm(inverse_root @ y) ** 2
        new = new + k.c_mu * rescaled * np.outer(y, y)
    grown = sigma * np.exp(k.c_sigma / k.d_sigma * (length / k.chi_n - 1))
    return mean + sigma * average, grown, new, (path_sigma, path_c), bool(quiet)


def test_update_is_that_of_the_tutorial() -> None:
    run = CMAES(np.ones(5), 1e-2, population=9, covariance="full", rng=0)
    mean, sigma, matrix, paths = np.ones(5), 1e-2, np.eye(5), (np.zeros(5), np.zeros(5))
    stalls = []
    for generation in range(1, 61):
        samples = run.ask()
        losses = ellipsoid(samples)
        run.tell(samples, losses)
        ranked = samples[np.argsort(losses)]
        mean, sigma, matrix, paths, quiet = naive_step(mean, sigma, matrix, paths, ranked, generation)
        stalls.append(not quiet)
        np.testing.assert_allclose(run.mean, mean, rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(np.asarray(run.state()["matrix"]), matrix, rtol=1e-6, atol=1e-9)
        assert run.sigma == pytest.approx(sigma, rel=1e-6)
    assert 0 < sum(stalls) < len(stalls)


def cigar(x: Array) -> Array:
    return x[..., 0] ** 2 + 1e6 * np.square(x[..., 1:]).sum(axis=-1)


def rotated(function: Function, n: int) -> Function:
    basis, _ = np.linalg.qr(np.random.default_rng(3).standard_normal((n, n)))
    return lambda x: function(x @ basis)


def least(run: CMAES, function: Function, count: int) -> float:
    return generations(run, function, count).best_loss


def test_low_rank_converges_on_a_rotated_cigar_and_diagonal_does_not() -> None:
    function, start = rotated(cigar, 100), np.random.default_rng(0).standard_normal(100)
    low_rank, diagonal = (
        least(CMAES(start, 0.5, covariance=covariance, rng=0), function, 3000)
        for covariance in ("low_rank", "diagonal")
    )
    assert low_rank < 1e-6
    assert low_rank < 1e-3 * diagonal


@pytest.mark.parametrize("function", [sphere, ellipsoid, rotated(ellipsoid, 500), rosenbrock])
def test_low_rank_is_no_worse_than_diagonal_in_thirty_generations_of_fifty(function: Function) -> None:
    start = np.zeros(500) if function is rosenbrock else np.random.default_rng(0).standard_normal(500)
    sigma = 0.1 if function is rosenbrock else 0.3
    low_rank, diagonal = (
        least(CMAES(start, sigma, population=50, covariance=covariance, rng=0), function, 30)
        for covariance in ("low_rank", "diagonal")
    )
    assert low_rank < 1.05 * diagonal


def test_low_rank_takes_about_as_many_evaluations_as_vkd_cma_of_the_reference() -> None:
    """A cigar of 20 variables; the reference adapts the number of directions and starts with none."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        package = pytest.importorskip("cma")
        sampler = importlib.import_module("cma.restricted_gaussian_sampler").GaussVkDSampler
        function, reference = rotated(cigar, 20), []
        for seed in range(2):
            options = {"seed": seed + 1, "verbose": -9, "verb_log": 0, "tolfun": 0, "tolx": 0}
            run = package.CMAEvolutionStrategy(np.ones(20), 0.5, sampler.extend_cma_options(options))
            while run.best.f > TARGET and run.countiter < 3000:
                samples = run.ask()
                run.tell(samples, function(np.array(samples)).tolist())
            reference.append(run.countevals)
    own = [evaluations_to_target(function, np.ones(20), 0.5, "low_rank", seed) for seed in range(3)]
    assert np.median(own) / np.median(reference) <= 1.15


class Counted(np.ndarray):
    """An array that counts the multiplications and the like of what is done with it."""

    operations = 0

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        plain = [np.asarray(value) for value in inputs]
        if "out" in options:
            options["out"] = tuple(np.asarray(value) for value in options["out"])
        result = getattr(ufunc, method)(*plain, **options)
        if ufunc is np.matmul:
            Counted.operations += plain[0].shape[-1] * np.size(result)
        else:
            Counted.operations += max(np.size(result), *(value.size for value in plain))
        return np.asarray(result).view(Counted)


def operations(n: int, covariance: Covariance) -> int:
    """Element operations, an upper bound in products, of colouring, whitening and learning 50 samples."""
    run = generations(CMAES(np.zeros(n), 0.5, population=50, covariance=covariance, rng=0), sphere, 2)
    shape = run._shape
    for name, value in vars(shape).items():
        if isinstance(value, np.ndarray):
            setattr(shape, name, value.view(Counted))
    normal = np.random.default_rng(0).standard_normal((50, n)).view(Counted)
    Counted.operations = 0
    steps = shape.colour(normal)
    shape.whiten(steps[0])
    shape.distance2(steps[25:])
    shape.update(0.9, 0.01, steps[0], np.linspace(0.01, -0.005, 50), steps)
    return Counted.operations


@pytest.mark.parametrize("covariance", ["diagonal", "low_rank"])
def test_cost_is_linear_in_the_variables(covariance: Covariance) -> None:
    assert operations(400, covariance) > 400 * 50
    assert operations(4000, covariance) <= 10.5 * operations(400, covariance)
    assert operations(400, "full") > 12 * operations(100, "full")


@pytest.mark.parametrize("covariance", ["diagonal", "low_rank"])
def test_memory_is_linear_in_the_variables(covariance: Covariance) -> None:
    peaks, kept = [], []
    for n in (500, 5000):
        run = CMAES(np.zeros(n), 0.5, population=50, covariance=covariance, rng=0)
        tracemalloc.start()
        generations(run, sphere, 2)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        kept.append(sum(np.size(value) for value in run.state().values()))
    assert peaks[1] < 11 * peaks[0]
    assert kept[1] < 10 * kept[0]


def test_low_rank_algebra_is_that_of_its_matrix() -> None:
    run = generations(CMAES(np.ones(30), 0.5, population=20, covariance="low_rank", rng=0), cigar, 60)
    shape, steps = run._shape, np.random.default_rng(1).standard_normal((7, 30))
    factor = shape.colour(np.eye(30)).T
    matrix = factor @ factor.T
    assert np.linalg.matrix_rank(matrix - np.diag(np.diag(matrix))) > 0
    np.testing.assert_allclose(shape.whiten(shape.colour(steps)), steps, atol=1e-9)
    np.testing.assert_allclose(shape.deviations**2, np.diag(matrix), rtol=1e-9)
    expected = np.einsum("pi,ij,pj->p", steps, np.linalg.inv(matrix), steps)
    np.testing.assert_allclose(shape.distance2(steps), expected, rtol=1e-6)
    axes = np.asarray(run.state()["axes"])
    np.testing.assert_allclose(axes @ axes.T, np.eye(len(axes)), atol=1e-9)


def test_low_rank_projection_is_exact_where_the_updated_matrix_has_its_form() -> None:
    """Directions along axes on an isotropic rest: eq. 47 stays within the model, so nothing is lost."""
    n, shape = 12, covariances.identity("low_rank", 12, 0.1)
    path, steps = 3.0 * np.eye(n)[0], 2.0 * np.eye(n)[1:4]
    expected = np.ones(n)
    for _ in range(3):
        shape.update(0.7, 0.2, path, np.full(3, 0.1), steps)
        expected *= 0.7
        expected[:4] += [1.8, 0.4, 0.4, 0.4]
    factor = shape.colour(np.eye(n)).T
    np.testing.assert_allclose(factor @ factor.T, np.diag(expected), rtol=1e-9, atol=1e-9)


def test_resumed_run_keeps_the_age_of_the_decomposition() -> None:
    run = generations(CMAES(np.ones(300), 0.5, population=6, covariance="full", rng=0), ellipsoid, 1)
    assert run.state()["age"] == 1
    resumed = CMAES.from_state(run.state())
    for one in (run, resumed):
        generations(one, ellipsoid, 8)
    assert run.mean.tobytes() == resumed.mean.tobytes()


def test_known_constants() -> None:
    """n = 10, P = 10: eq. 49 to 58 worked out by hand."""
    constants = strategy(10, 10, "full")
    assert constants.mu == 5
    assert constants.mu_eff == pytest.approx(3.1673, abs=1e-4)
    assert constants.c_1 == pytest.approx(2 / (11.3**2 + 3.1673), abs=1e-6)
    assert constants.c_sigma == pytest.approx(5.1673 / 18.1673, abs=1e-5)
    assert constants.chi_n == pytest.approx(3.0847, abs=1e-3)
    assert strategy(10, 10, "diagonal").c_1 == pytest.approx(4 * constants.c_1)


def test_generation_of_four_hundred_variables_takes_less_than_a_millisecond() -> None:
    run = CMAES(np.zeros(400), 0.1, population=64, rng=0)
    losses = np.random.default_rng(0).random(64)
    seconds = []
    for _ in range(100):
        begin = time.perf_counter()
        run.tell(run.ask(), losses)
        seconds.append(time.perf_counter() - begin)
    assert min(seconds) < 1e-3


@pytest.mark.parametrize(
    ("samples", "losses", "what"),
    [
        (np.zeros((7, 4)), np.zeros(8), r"samples: shape \(7, 4\); valid is \(8, 4\)"),
        (np.zeros((4, 8)), np.zeros(8), "samples: shape"),
        (np.zeros((8, 4)), np.zeros(7), r"losses: shape \(7,\); valid is \(8,\)"),
        (np.zeros((8, 4)), np.zeros((8, 1)), "losses: shape"),
        (np.full((8, 4), np.nan), np.zeros(8), "samples: NaN"),
    ],
)
def test_wrong_shapes_are_named_and_change_nothing(samples: Array, losses: Array, what: str) -> None:
    run = CMAES(np.ones(4), 0.5, population=8, rng=0)
    with pytest.raises(ValueError, match=what):
        run.tell(samples, losses)
    assert run.generation == 0
    np.testing.assert_array_equal(run.mean, np.ones(4))


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"mean": np.ones((2, 2))}, "mean"),
        ({"mean": np.array([np.nan, 0.0])}, "mean"),
        ({"sigma": 0.0}, "sigma"),
        ({"sigma": np.inf}, "sigma"),
        ({"scales": np.ones(3)}, "scales"),
        ({"scales": np.array([1.0, 0.0])}, "scales"),
        ({"population": 1}, "population"),
        ({"covariance": "dense"}, "covariance"),
        ({"bounds": np.zeros(2)}, "bounds: shape"),
        ({"bounds": np.ones((2, 2))}, "lower < upper"),
        ({"bounds": np.array([[0.0, 0.5], [0.0, 2.0]])}, "outside the bounds"),
    ],
)
def test_bad_arguments_are_named(change: dict[str, Any], what: str) -> None:
    with pytest.raises(ValueError, match=what):
        CMAES(**{"mean": np.ones(2), "sigma": 0.5, "rng": 0, **change})
