"""Scores of sampled futures, by hand."""

from __future__ import annotations

import numpy as np

from tools.study import future_distances as futures


def test_the_best_sample_counts() -> None:
    true = np.zeros((4, 3, 3))
    samples = np.zeros((2, 4, 3, 3))
    samples[0, :, 1:, 0] = 0.3  # off all the time
    samples[1, -1, 1:, 0] = 0.4  # off in the end
    np.testing.assert_allclose(futures.ade(samples, true), 0.1)
    np.testing.assert_allclose(futures.fde(samples, true), 0.3)


def test_the_root_does_not_count() -> None:
    true = np.zeros((4, 3, 3))
    samples = np.full((2, 4, 3, 3), 5.0)
    assert futures.ade(samples, true) == futures.fde(samples, true) == futures.apd(samples) == 0.0


def test_diversity_is_the_mean_over_pairs() -> None:
    samples = np.zeros((3, 4, 2, 3))
    samples[2, :, 1, 2] = 1.0  # 2 m from both others, which are alike
    np.testing.assert_allclose(futures.apd(samples), (0 + 2 + 2) / 3)
