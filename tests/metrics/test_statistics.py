from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from simrecon.metrics import statistics
from simrecon.metrics.statistics import Series
from simrecon.types import Array


def test_a_series_is_a_mean_of_what_counts() -> None:
    values = np.array([[1.0, 2.0], [np.nan, 4.0], [5.0, 6.0]])
    assert statistics.of_frames(values).value == pytest.approx(18 / 5)
    counted = np.array([[True, False], [True, True], [False, False]])
    assert statistics.of_frames(values, counted, scale=10).value == pytest.approx(25)
    assert statistics.of_frames(np.array([9.0, 16.0]), root=True).value == pytest.approx(np.sqrt(12.5))
    assert np.isnan(Series(np.zeros(3), np.zeros(3)).value)


def test_interval_covers_the_mean_of_independent_frames_as_often_as_it_says() -> None:
    hits = 0
    for seed in range(200):
        values = np.random.default_rng(seed).normal(size=100)
        low, high = statistics.interval(
            statistics.of_frames(values), 1, np.random.default_rng(1), samples=300
        )
        hits += low <= 0 <= high
    assert 180 <= hits <= 199


def autocorrelated(seed: int, frames: int, correlation: float) -> Array:
    """(T,) a first-order autoregressive series about 0."""
    noise = np.random.default_rng(seed).normal(size=frames + 100)
    return np.asarray(signal.lfilter([1.0], [1.0, -correlation], noise)[100:])


@pytest.mark.parametrize("frames", [60, 300])
def test_interval_covers_the_mean_of_frames_that_hang_together(frames: int) -> None:
    """2 and 10 s at 30 frames a second, correlated over 0.1 s; single frames would be right half the time."""
    hits = {1: 0, 15: 0}
    for seed in range(200):
        series = statistics.of_frames(autocorrelated(seed, frames, np.exp(-1 / 3)))
        for block in hits:
            low, high = statistics.interval(series, block, np.random.default_rng(1), samples=300)
            hits[block] += low <= 0 <= high
    assert 176 <= hits[15] <= 199
    assert hits[1] < 150


def test_blocks_are_as_long_for_scores_of_any_rate() -> None:
    fast = np.repeat(np.random.default_rng(0).normal(size=20), 30)  # 10 s at 60 frames a second
    limits = statistics.intervals(
        {"60": statistics.of_frames(fast), "30": statistics.of_frames(fast[::2])}, 10.0
    )
    np.testing.assert_allclose(np.ptp(limits["60"]), np.ptp(limits["30"]), rtol=0.1)


def test_blocks_widen_the_interval_of_frames_that_hang_together() -> None:
    values = np.repeat(np.random.default_rng(0).normal(size=20), 20)
    series = statistics.of_frames(values)
    single, block = (np.ptp(statistics.interval(series, n, np.random.default_rng(0))) for n in (1, 20))
    assert block > 2.5 * single


def test_interval_is_seeded_and_the_same_frames_are_drawn_for_every_score() -> None:
    values = np.random.default_rng(0).normal(size=60)
    pair = statistics.intervals(
        {"a": statistics.of_frames(values), "b": statistics.of_frames(2 * values)}, 2.0, seed=3
    )
    np.testing.assert_allclose(pair["b"], 2 * np.array(pair["a"]))
    other = statistics.intervals({"a": statistics.of_frames(values)}, 2.0, seed=4)
    assert other["a"] != pair["a"]


def test_interval_without_anything_that_counts() -> None:
    assert np.isnan(statistics.interval(Series(np.zeros(9), np.zeros(9)), 3, np.random.default_rng(0))).all()
