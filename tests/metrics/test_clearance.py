from __future__ import annotations

import numpy as np

from simrecon.geometry import rotations
from simrecon.metrics import clearance


def test_box_clearance_of_a_tilted_box() -> None:
    half = np.array([0.1, 0.05, 0.02])
    flat, tilted = np.eye(3), rotations.matrix(rotations.exp([0.0, np.pi / 2, 0.0]))
    position = np.array([0.0, 0.0, 0.3])
    low = clearance.box_clearance(
        np.stack((position, position)), np.stack((flat, tilted)), half, support=0.05
    )
    np.testing.assert_allclose(low, [0.3 - 0.02 - 0.05, 0.3 - 0.1 - 0.05])


def test_penetration_is_below_the_floor_only() -> None:
    depths = clearance.penetration_depths(np.array([[0.1, 0.3], [-0.002, 0.1], [-0.001, -0.006], [0.0, 0.0]]))
    np.testing.assert_allclose(depths, [0, 0.002, 0.006, 0])


def test_a_body_ten_millimetres_under_the_floor() -> None:
    distance = np.array([[0.5, -0.010], [0.5, -0.010], [0.4, -0.004], [0.4, 0.0]])
    np.testing.assert_allclose(clearance.penetration_depths(distance), [0.010, 0.010, 0.004, 0.0])
    np.testing.assert_array_equal(clearance.penetrating_frames(distance), [True, True, False, False])


def test_flight_leaves_out_the_frames_beside() -> None:
    distance = np.array([[0.0, 1.0], [0.2, 1.0], [0.2, 0.06], [0.2, 1.0], [0.2, 0.04]])
    np.testing.assert_array_equal(clearance.flight_frames(distance), [False, False, True, False, False])
