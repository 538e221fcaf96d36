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
from simrecon.types import Array, Camera, Lens

MATRIX = np.array([[900.0, 0.0, 640.0], [0.0, 870.0, 350.0], [0.0, 0.0, 1.0]])
DISTORTION = np.array([-0.2, 0.05, 0.002, -0.001, -0.01])
ROTVEC, TRANSLATION = np.array([0.3, -0.4, 0.2]), np.array([0.1, -0.2, 4.0])


def transform(rotvec: Array = ROTVEC, translation: Array = TRANSLATION) -> Array:
    matrix = np.eye(4)
    matrix[:3, :3] = rotations.matrix(rotations.exp(rotvec))
    matrix[:3, 3] = translation
    return matrix


LENS = Lens(MATRIX, DISTORTION, (1280, 720))


def still(world_to_camera: Array | None = None) -> Camera:
    return cameras.still(LENS, transform() if world_to_camera is None else world_to_camera)


def test_projection_is_that_of_opencv(rng: np.random.Generator) -> None:
    points_m = rng.uniform(-1, 1, size=(50, 3))
    reference, _ = cv2.projectPoints(points_m, ROTVEC, TRANSLATION, MATRIX, DISTORTION)
    np.testing.assert_allclose(cameras.project(still(), points_m), reference[:, 0], atol=1e-9)


def test_distortion_is_that_of_opencv(rng: np.random.Generator) -> None:
    rays = rng.uniform(-0.6, 0.6, size=(4, 7, 2))
    flat = np.concatenate((rays.reshape(-1, 2), np.ones((28, 1))), axis=1)
    reference, _ = cv2.projectPoints(flat, np.zeros(3), np.zeros(3), MATRIX, DISTORTION)
    np.testing.assert_allclose(cameras.distort(LENS, rays), reference.reshape(4, 7, 2), atol=1e-9)


@given(st.lists(st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)), min_size=1, max_size=6))
def test_undistortion_is_the_inverse(rays: list[tuple[float, float]]) -> None:
    ideal = np.array(rays)
    found = cameras.undistort(LENS, cameras.distort(LENS, ideal))
    np.testing.assert_allclose(found, ideal, atol=1e-7)


def test_where_a_camera_stands_is_found_if_the_points_say_it(rng: np.random.Generator) -> None:
    points = rng.uniform(-1.0, 1.0, (8, 3))
    camera = Camera(LENS, transform()[None])
    found = cameras.resected(LENS, points, cameras.project(camera, points[None])[0])
    assert found is not None
    np.testing.assert_allclose(found, transform(), atol=1e-6)
    assert cameras.resected(LENS, np.zeros((8, 3)), np.full((8, 2), 300.0)) is None


def test_unseen_points_stay_unseen() -> None:
    pixels = np.array([[[640.0, 350.0], [np.nan, np.nan]], [[np.nan, 3.0], [1540.0, 350.0]]])
    straight = replace(LENS, distortion=np.zeros(5))
    found = cameras.undistort(straight, pixels)
    np.testing.assert_allclose(found[[0, 1], [0, 1]], [[0.0, 0.0], [1.0, 0.0]], atol=1e-9)
    assert np.isnan(found[[0, 1], [1, 0]]).all()
    assert np.isnan(cameras.undistort(straight, np.full((2, 2), np.nan))).all()


def test_points_behind_the_camera_are_not_seen() -> None:
    camera = still(np.eye(4))
    found = cameras.project(camera, np.array([[0.0, 0.0, 2.0], [0.0, 0.0, -2.0], [0.1, 0.0, 0.0]]))
    np.testing.assert_allclose(found[0], MATRIX[:2, 2])
    assert np.isnan(found[1:]).all()


def test_a_moving_camera_has_its_transform_by_frame(rng: np.random.Generator) -> None:
    points_m = rng.uniform(-1, 1, size=(3, 5, 3))  # (T, J, 3)
    moves = np.stack([transform(ROTVEC * t, TRANSLATION + t) for t in range(3)])  # (T, 4, 4)
    camera = Camera(LENS, moves)
    single = [still(move) for move in moves]
    expected = np.stack(
        [cameras.project(each, points) for each, points in zip(single, points_m, strict=True)]
    )
    np.testing.assert_allclose(cameras.project(camera, points_m), expected)
    np.testing.assert_allclose(cameras.project(camera, points_m[:, 0]), expected[:, 0])
    np.testing.assert_allclose(cameras.centre_m(camera), [cameras.centre_m(each)[0] for each in single])


def test_centre_is_the_origin_of_the_camera_frame() -> None:
    camera = still()
    np.testing.assert_allclose(
        cameras.to_camera(camera, cameras.centre_m(camera)), np.zeros((1, 3)), atol=1e-12
    )


def test_focal_length_is_the_geometric_mean() -> None:
    assert cameras.focal_px(LENS) == pytest.approx(np.sqrt(900.0 * 870.0))


def test_without_extrinsics_world_points_are_an_error() -> None:
    camera = Camera(LENS)
    with pytest.raises(InputError, match="world_to_camera"):
        cameras.project(camera, np.ones((2, 3)))
    moved = cameras.with_path(camera, np.eye(4)[None])
    np.testing.assert_array_equal(cameras.extrinsics(moved), np.eye(4)[None])
    assert camera.path is None


def test_a_still_camera_gives_the_bits_of_its_one_transform(rng: np.random.Generator) -> None:
    points_m = rng.uniform(-1, 1, size=(20, 7, 3))
    rotation, translation = transform()[:3, :3], transform()[:3, 3]
    camera = cameras.still(LENS, transform(), len(points_m))
    np.testing.assert_array_equal(
        cameras.to_camera(camera, points_m), (rotation @ points_m[..., None])[..., 0] + translation
    )
    np.testing.assert_array_equal(cameras.project(camera, points_m), cameras.project(still(), points_m))


def test_frames_of_a_camera() -> None:
    moves = np.stack([transform(ROTVEC * t, TRANSLATION + t) for t in range(4)])
    moving = Camera(LENS, moves)
    assert not cameras.is_still(moving)
    np.testing.assert_array_equal(cameras.at(moving, slice(1, 3)).path, moves[1:3])
    np.testing.assert_array_equal(
        cameras.at(moving, np.array([True, False, False, True])).path, moves[[0, 3]]
    )
    standing = cameras.lasting(cameras.at(moving, slice(2, 3)), 5)
    assert cameras.is_still(standing)
    np.testing.assert_array_equal(standing.path, np.repeat(moves[2:3], 5, axis=0))
    unknown = Camera(LENS)
    assert cameras.is_still(unknown)
    assert cameras.at(unknown, slice(2)).path is None
    assert cameras.lasting(unknown, 5).path is None
