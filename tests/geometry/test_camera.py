"""The camera against OpenCV's own projection."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simrecon.errors import InputError
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.types import Array, Camera

MATRIX = np.array([[900.0, 0.0, 640.0], [0.0, 870.0, 350.0], [0.0, 0.0, 1.0]])
DISTORTION = np.array([-0.2, 0.05, 0.002, -0.001, -0.01])
ROTVEC, TRANSLATION = np.array([0.3, -0.4, 0.2]), np.array([0.1, -0.2, 4.0])


def transform(rotvec: Array = ROTVEC, translation: Array = TRANSLATION) -> Array:
    matrix = np.eye(4)
    matrix[:3, :3] = rotations.matrix(rotations.exp(rotvec))
    matrix[:3, 3] = translation
    return matrix


def lens(**changes: object) -> Camera:
    return replace(Camera(MATRIX, DISTORTION, transform(), (1280, 720)), **changes)


def test_projection_is_that_of_opencv(rng: np.random.Generator) -> None:
    points_m = rng.uniform(-1, 1, size=(50, 3))
    reference, _ = cv2.projectPoints(points_m, ROTVEC, TRANSLATION, MATRIX, DISTORTION)
    np.testing.assert_allclose(cameras.project(lens(), points_m), reference[:, 0], atol=1e-9)


def test_distortion_is_that_of_opencv(rng: np.random.Generator) -> None:
    rays = rng.uniform(-0.6, 0.6, size=(4, 7, 2))
    flat = np.concatenate((rays.reshape(-1, 2), np.ones((28, 1))), axis=1)
    reference, _ = cv2.projectPoints(flat, np.zeros(3), np.zeros(3), MATRIX, DISTORTION)
    np.testing.assert_allclose(cameras.distort(lens(), rays), reference.reshape(4, 7, 2), atol=1e-9)


@given(st.lists(st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)), min_size=1, max_size=6))
def test_undistortion_is_the_inverse(rays: list[tuple[float, float]]) -> None:
    ideal = np.array(rays)
    rays = cameras.undistort(lens(), cameras.distort(lens(), ideal))
    np.testing.assert_allclose(rays, ideal, atol=1e-7)


def test_unseen_points_stay_unseen() -> None:
    pixels = np.array([[[640.0, 350.0], [np.nan, np.nan]], [[np.nan, 3.0], [1540.0, 350.0]]])
    straight = lens(distortion=np.zeros(5))
    rays = cameras.undistort(straight, pixels)
    np.testing.assert_allclose(rays[[0, 1], [0, 1]], [[0.0, 0.0], [1.0, 0.0]], atol=1e-9)
    assert np.isnan(rays[[0, 1], [1, 0]]).all()
    assert np.isnan(cameras.undistort(straight, np.full((2, 2), np.nan))).all()


def test_points_behind_the_camera_are_not_seen() -> None:
    camera = lens(world_to_camera=np.eye(4))
    pixels = cameras.project(camera, np.array([[0.0, 0.0, 2.0], [0.0, 0.0, -2.0], [0.1, 0.0, 0.0]]))
    np.testing.assert_allclose(pixels[0], MATRIX[:2, 2])
    assert np.isnan(pixels[1:]).all()


def test_a_moving_camera_has_its_transform_by_frame(rng: np.random.Generator) -> None:
    points_m = rng.uniform(-1, 1, size=(3, 5, 3))  # (T, J, 3)
    moves = np.stack([transform(ROTVEC * t, TRANSLATION + t) for t in range(3)])  # (T, 4, 4)
    camera = lens(world_to_camera=moves)
    single = [lens(world_to_camera=move) for move in moves]
    expected = np.stack(
        [cameras.project(each, points) for each, points in zip(single, points_m, strict=True)]
    )
    np.testing.assert_allclose(cameras.project(camera, points_m), expected)
    np.testing.assert_allclose(cameras.project(camera, points_m[:, 0]), expected[:, 0])
    np.testing.assert_allclose(cameras.centre_m(camera), [cameras.centre_m(each) for each in single])


def test_centre_is_the_origin_of_the_camera_frame() -> None:
    camera = lens()
    np.testing.assert_allclose(cameras.to_camera(camera, cameras.centre_m(camera)), np.zeros(3), atol=1e-12)


def test_focal_length_is_the_geometric_mean() -> None:
    assert cameras.focal_px(lens()) == pytest.approx(np.sqrt(900.0 * 870.0))


def test_without_extrinsics_world_points_are_an_error() -> None:
    camera = lens(world_to_camera=None)
    with pytest.raises(InputError, match="world_to_camera"):
        cameras.project(camera, np.ones((2, 3)))
    moved = cameras.with_extrinsics(camera, np.eye(4))
    np.testing.assert_array_equal(cameras.extrinsics(moved), np.eye(4))
    assert camera.world_to_camera is None
