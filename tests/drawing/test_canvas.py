"""What is painted on an image."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon.drawing import canvas


@pytest.mark.parametrize("alpha", [1.0, 0.6, 0.0])
def test_polygons_are_blended_over_what_is_there(alpha: float, rng: np.random.Generator) -> None:
    image = rng.integers(0, 256, (40, 60, 3)).astype(np.uint8)
    before, colour = image.astype(float), np.array([250.0, 120.0, 10.0])
    # from the edge of a pixel to that of another; whole numbers are pixel centres
    square = np.array([[9.5, 4.5], [29.5, 4.5], [29.5, 24.5], [9.5, 24.5]])
    canvas.paint(image, square[None], colour[None], alpha)
    inside = np.zeros((40, 60), bool)
    inside[7:23, 12:28] = True
    blended = (1 - alpha) * before[inside] + alpha * colour
    assert np.abs(image[inside] - blended).max() <= 0.5 + 1e-4
    outside = np.ones((40, 60), bool)
    outside[3:27, 8:32] = False
    np.testing.assert_array_equal(image[outside], before[outside])


def test_later_polygons_hide_earlier_ones_and_what_is_outside_is_left_out() -> None:
    image = np.zeros((20, 20, 3), np.uint8)
    square = np.array([[-5.0, -5.0], [12.0, -5.0], [12.0, 12.0], [-5.0, 12.0]])
    canvas.paint(image, np.stack((square, square)), np.array([[255.0, 0, 0], [0, 255.0, 0]]), 1.0)
    np.testing.assert_array_equal(image[5, 5], [0, 255, 0])
    beside = image.copy()
    canvas.paint(image, square[None] + 100.0, np.full((1, 3), 255.0), 1.0)
    np.testing.assert_array_equal(image, beside)
