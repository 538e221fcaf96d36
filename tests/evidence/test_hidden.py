from __future__ import annotations

import numpy as np
import pytest

from simrecon.errors import InputError
from simrecon.evidence import unknown_camera
from simrecon.types import Camera, Evidence


def seen(camera: Camera | None) -> Evidence:
    pixels, scores = np.zeros((3, 1, 2)), np.ones((3, 1))
    return Evidence(
        np.arange(3) / 30, ("nose",), pixels, scores, (), np.empty((3, 0, 3)), "world", camera=camera
    )


def test_lens_and_place_are_hidden() -> None:
    matrix = np.array([[900.0, 0, 500], [0, 900.0, 300], [0, 0, 1]])
    hidden = unknown_camera(seen(Camera(matrix, np.full(5, 0.1), np.eye(4), (800, 600)))).camera
    assert hidden is not None
    np.testing.assert_array_equal(hidden.matrix_px, [[1000, 0, 400], [0, 1000, 300], [0, 0, 1]])
    assert not hidden.distortion.any()
    assert hidden.world_to_camera is None


def test_landmarks_need_an_image_size() -> None:
    with pytest.raises(InputError, match="--size"):
        unknown_camera(seen(None))
