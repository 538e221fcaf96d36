"""IPOP restarts: lower values than one run at equal evaluations, resumable to the bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from simrecon.cmaes import CMAES, Covariance
from simrecon.restarts import Restarts
from simrecon.types import Array

TOLERANCES = {"tol_loss": 1e-9, "tol_sigma": 1e-9}


def rastrigin(x: Array) -> Array:
    return 10 * x.shape[-1] + (x * x - 10 * np.cos(2 * np.pi * x)).sum(axis=-1)


def minimise(run: CMAES | Restarts, evaluations: int) -> float:
    while run.evaluations < evaluations:
        samples = run.ask()
        run.tell(samples, rastrigin(samples))
    return run.best_loss


@pytest.mark.parametrize("covariance", ["diagonal", "low_rank"])
def test_lower_values_than_one_run_at_equal_evaluations(covariance: Covariance) -> None:
    alone, restarted = [], []
    for seed in range(5):
        start = np.random.default_rng(seed).uniform(-5, 5, 8)
        alone.append(minimise(CMAES(start, 2.0, covariance=covariance, rng=seed), 20_000))
        runs = Restarts(start, 2.0, covariance=covariance, seed=seed, **TOLERANCES)
        restarted.append(minimise(runs, 20_000))
        assert runs.restarts >= 2
        assert runs.run.population == 10 * 2**runs.restarts
        assert rastrigin(runs.best_x) == runs.best_loss
    assert np.median(restarted) < 0.5 * np.median(alone)
    assert max(restarted) <= np.median(alone)


def test_run_that_still_improves_is_left_alone() -> None:
    runs = Restarts(np.full(8, 3.0), 0.5, seed=0, **TOLERANCES)
    alone = CMAES(np.full(8, 3.0), 0.5, rng=np.random.default_rng([0, 0]))
    assert minimise(runs, 500) == minimise(alone, 500)
    assert runs.restarts == 0


def test_new_run_begins_within_the_bounds_with_the_first_step_size() -> None:
    bounds = np.tile([2.0, 3.0], (4, 1))
    runs = Restarts(
        np.full(4, 2.9), 0.2, bounds=bounds, tol_loss=np.inf, tol_sigma=0.0, generations=7, seed=1
    )
    for restart in (1, 2):
        before = runs.run
        for _ in range(7):
            samples = runs.ask()
            runs.tell(samples, rastrigin(samples))
        assert runs.restarts == restart
        assert runs.run.sigma == 0.2
        assert ((runs.run.mean >= 2.0) & (runs.run.mean <= 3.0)).all()
        assert runs.best_loss <= before.best_loss
        assert runs.run.generation == 0


def test_resumed_runs_have_the_same_bits(tmp_path: Any) -> None:
    runs = Restarts(np.ones(5), 2.0, population=8, tol_loss=1e-3, tol_sigma=0.3, generations=10, seed=3)
    minimise(runs, 1500)
    np.savez(tmp_path / "state.npz", allow_pickle=False, **runs.state())
    with np.load(tmp_path / "state.npz", allow_pickle=False) as state:
        resumed = Restarts.from_state(state)
    assert runs.restarts > 0
    count = runs.restarts
    assert minimise(runs, 9000) == minimise(resumed, 9000)
    assert runs.restarts == resumed.restarts > count
    assert runs.best_x.tobytes() == resumed.best_x.tobytes()
    assert runs.ask().tobytes() == resumed.ask().tobytes()
