"""Difference of velocities in the image, by hand."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon.kinematics.terms.image_velocity import velocity
from simrecon.types import Array
from tests.support.gradients import differences

CAMERA = np.eye(4)
CAMERA[:3, :3] = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
CAMERA[2, 3] = 5.0


def test_velocities_in_the_image_by_hand() -> None:
    # both go to the right; 2 m/s at a distance of 5 m are 0.4 per second
    points = np.array([[[0.0, -0.2 * t, 0.5] for t in range(4)]])
    rays = np.array([[[0.3 + 0.04 * t, 0.2] for t in range(4)]])
    assert velocity(points, rays, np.ones((1, 3)), CAMERA, 0.1, 0.1)[0] == pytest.approx(0.0, abs=1e-12)
    slower = np.array([[[0.3 + 0.03 * t, 0.2] for t in range(4)]])
    assert velocity(points, slower, np.array([[1.0, 0.5, 0.0]]), CAMERA, 0.1, 0.1)[0] == pytest.approx(
        1.5 * np.log(2.0)
    )


@pytest.mark.parametrize("behind_m", [0.0, 6.0])
def test_the_gradient_of_velocities_is_that_of_finite_differences(behind_m: float) -> None:
    rng = np.random.default_rng(6)
    points, rays = rng.normal(size=(3, 4, 3)) - [behind_m, 0.0, 0.0], rng.normal(size=(3, 4, 2))
    weights, moving = rng.uniform(0, 1, (3, 3)), np.tile(CAMERA, (4, 1, 1))
    moving[:, 0, 3] = np.arange(4)

    def loss(x: Array) -> tuple[float, Array]:
        return velocity(x, rays, weights, moving, 0.1, 20.0)

    gradient = loss(points)[1]
    np.testing.assert_allclose(gradient, differences(loss, points), rtol=1e-5, atol=1e-6)
