"""Balance over the feet, by hand."""

from __future__ import annotations

import numpy as np

from simrecon.kinematics.terms.mass import balance
from simrecon.types import Array
from tests.support.gradients import differences


def test_the_gradient_of_balance_is_that_of_finite_differences() -> None:
    rng = np.random.default_rng(5)
    com = rng.normal([0.0, 0.0, 0.9], [0.2, 0.2, 0.05], (8, 3))
    feet = rng.normal([[[0.0, 0.1, 0.0]], [[0.0, -0.1, 0.0]]], 0.05, (2, 8, 3))
    standing = np.array([[1, 1, 1, 0, 0, 0.5, 1, 1], [1, 0.1, 0.8, 0.9, 0, 0.2, 1, 0]], dtype=float)

    def loss(where: Array) -> tuple[float, Array]:
        feet_m = where[8:24].reshape(2, 8, 3)
        value, *slopes, d_borne = balance(where[:8], feet_m, standing, where[24:, 0], 0.2, 0.05)
        slopes.append(np.outer(d_borne, [1.0, 0.0, 0.0]))
        return value, np.concatenate([slope.reshape(-1, 3) for slope in slopes])

    where = np.concatenate((com, feet.reshape(16, 3), rng.uniform(0, 1, (8, 3))))
    _, gradient = loss(where)
    assert np.abs(gradient).max() > 1
    np.testing.assert_allclose(gradient, differences(loss, where), rtol=1e-4, atol=1e-4)


def test_who_stands_over_a_foot_is_in_balance_and_who_leans_is_not() -> None:
    feet = np.zeros((2, 5, 3))
    feet[:, :, 1] = [[0.1], [-0.1]]
    both, left = np.ones((2, 5)), np.stack((np.ones(5), np.zeros(5)))
    over, lean, right = (
        np.tile(place, (5, 1)) for place in ([0.0, 0.0, 0.9], [0.3, 0.0, 0.9], [0.0, -0.1, 0.9])
    )
    alone = np.ones(5)
    assert balance(over, feet, both, alone, 0.1, 0.05)[0] == 0.0
    assert balance(lean, feet, both, alone, 0.1, 0.05)[0] > 1.0
    assert balance(right, feet, both, alone, 0.1, 0.05)[0] == 0.0
    assert balance(right, feet, left, alone, 0.1, 0.05)[0] > 1.0
    assert balance(lean, feet, np.zeros((2, 5)), alone, 0.1, 0.05)[0] == 0.0
    assert balance(lean, feet, both, np.zeros(5), 0.1, 0.05)[0] == 0.0  # something else bears, too
