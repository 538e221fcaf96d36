"""What keeps a plan steady: its sums, slopes and curvature."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon.planners.soft_contact import steady


def test_a_change_counts_by_its_square_where_it_is_small_and_by_its_size_where_it_is_large() -> None:
    wrench = np.zeros((3, 6))
    assert steady.rate(wrench, 0.1)[0] == 0.0
    wrench[1:, 2] = 0.001
    assert steady.rate(wrench, 0.1)[0] == pytest.approx(0.5 * 0.01**2, rel=1e-3)
    wrench[1:, 2] = 10.0
    assert steady.rate(wrench, 0.1)[0] == pytest.approx(100.0 - 1.0, rel=1e-3)


def test_its_slope_is_that_of_the_sum_and_its_curvature_bounds_it() -> None:
    rng = np.random.default_rng(0)
    wrench, move, unit = rng.standard_normal((9, 6)), rng.standard_normal((9, 6)), 0.7
    ahead, back = (steady.rate(wrench + sign * 1e-6 * move, unit) for sign in (1, -1))
    _, slope = steady.rate(wrench, unit)
    assert np.sum(slope * move) == pytest.approx((ahead[0] - back[0]) / 2e-6, rel=1e-6)
    curved = np.sum((ahead[1] - back[1]) * move) / 2e-6
    assert 0 < curved <= steady.rate_curvature(unit) * np.sum(move**2)


def test_the_place_counts_in_its_unit() -> None:
    com = np.zeros((4, 3))
    com[2] = [0.03, 0.04, 0.0]
    loss, slope = steady.place(com, np.zeros((4, 3)), 0.05)
    assert loss == pytest.approx(0.5)
    np.testing.assert_allclose(slope[2], [12.0, 16.0, 0.0])
    assert not slope[[0, 1, 3]].any()
