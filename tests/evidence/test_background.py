from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon.evidence.camera import turning
from simrecon.evidence.camera.turning import Views
from simrecon.evidence.video import carried
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.types import Camera
from tests.support import textured

T = 40


@pytest.fixture(scope="module")
def panned() -> Views:
    """Of a camera that pans by 20°, with somebody walking before it."""
    picture, images, people = textured.wall(), [], []
    for t, rotation in enumerate(textured.swaying(T)):
        images.append(textured.turned(picture, rotation))
        people.append((textured.somebody(images[-1], 40 + 8 * t),))
    return textured.views(images, people)


def angles_deg(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.degrees(rotations.angle_between(rotations.from_matrix(a), rotations.from_matrix(b)))


def test_rotations_of_a_panning_camera(panned: Views) -> None:
    turn = turning.turned(panned, textured.LENS)
    assert angles_deg(turn.rotations, textured.swaying(T)).max() < 0.3
    np.testing.assert_array_equal(turn.zooms, 1.0)
    assert turn.unlike < turning.UNLIKE_MAX / 3
    assert not turning.is_still(panned, textured.SIZE)


def test_the_focal_length_follows_from_how_the_background_turns(panned: Views) -> None:
    matrix = textured.LENS.matrix_px.copy()
    matrix[[0, 1], [0, 1]] *= np.exp(0.25)
    wrong = replace(textured.LENS, matrix_px=matrix, focal_sigma=0.245)
    offset, sigma = turning.focal_offset(panned, wrong)
    assert offset == pytest.approx(-0.25, abs=0.03)
    assert sigma < 0.05
    found = carried.follow(Camera(wrong), panned)
    assert cameras.focal_px(found.camera.lens) == pytest.approx(textured.FOCAL, rel=0.03)
    assert "turns by up to 20°, by which the focal length is 4" in found.notes[0]


def test_the_path_begins_where_the_camera_is_known_to_stand(panned: Views) -> None:
    place = np.eye(4)
    place[:3] = [[1, 0, 0, 0.5], [0, 0, -1, 1.2], [0, 1, 0, 3.0]]
    known = carried.follow(cameras.still(textured.LENS, place), panned).camera
    np.testing.assert_allclose(cameras.extrinsics(known)[0], place, atol=1e-9)
    np.testing.assert_allclose(cameras.centre_m(known), np.tile([-0.5, -3.0, 1.2], (T, 1)), atol=1e-9)
    level = cameras.extrinsics(carried.follow(Camera(textured.LENS), panned).camera)
    assert abs(level[:, 1, 2].mean() + 1) < 0.01  # the image's downward axis is the world's, on average
    np.testing.assert_allclose(level[:, :3, 3], 0.0, atol=1e-12)


def test_a_camera_that_stands_still_is_left_alone() -> None:
    picture, images, people = textured.wall(), [], []
    rng = np.random.default_rng(0)
    for t in range(12):
        image = textured.turned(picture, np.eye(3)).astype(float) + rng.normal(0, 3, (270, 480, 3))
        images.append(np.clip(image, 0, 255).astype(np.uint8))
        people.append((textured.somebody(images[-1], 40 + 20 * t),))
        textured.somebody(images[-1], 400 - 30 * t, seed=2)  # of whom nobody knows
    still = textured.views(images, people)
    camera = Camera(textured.LENS)
    found = carried.follow(camera, still)
    assert found.camera is camera
    assert found.notes == ()
    points = rng.uniform(0, 400, (12, 3, 2))
    np.testing.assert_allclose(found.in_one_lens(points), points, atol=1e-12)


def test_a_zoom_is_taken_out_of_the_landmarks() -> None:
    picture, zooms = textured.wall(), np.linspace(1.0, 1.3, 20)
    images = [textured.turned(picture, r, z) for r, z in zip(textured.swaying(20, 0.1), zooms, strict=True)]
    found = carried.follow(Camera(textured.LENS), textured.views(images))
    np.testing.assert_allclose(found.zooms, zooms, atol=0.02)
    assert "it zooms from 1.00 to 1.3" in found.notes[1]
    centre = textured.LENS.matrix_px[:2, 2]
    shown = centre + zooms[:, None, None] * np.array([[50.0, 20.0]])
    np.testing.assert_allclose(found.in_one_lens(shown) - centre, np.tile([50.0, 20.0], (20, 1, 1)), atol=1)


def test_a_camera_that_is_carried_past_near_things_is_said_to_be() -> None:
    far, near, images = textured.wall(), textured.wall(3), []
    for t in range(20):
        image = textured.turned(far, np.eye(3))
        shift = np.eye(3)
        shift[0, 2] = 6.0 * t
        close = textured.seen(near, shift)
        image[150:] = close[150:]  # a floor that passes
        images.append(image[:, :])
        image[:150] = textured.seen(far, np.array([[1, 0, 2.0 * t], [0, 1, 0], [0, 0, 1]]))[:150]
    notes = carried.follow(Camera(textured.LENS), textured.views(images)).notes
    assert any("it is carried as well" in note for note in notes)


def test_one_thing_that_moves_is_no_background() -> None:
    images = [np.full((270, 480, 3), 128, np.uint8) for _ in range(8)]
    for t, image in enumerate(images):
        textured.somebody(image, 150 + 6 * t)
    camera = Camera(textured.LENS)
    assert carried.follow(camera, textured.views(images)).camera is camera


def test_a_background_without_features() -> None:
    blank = [np.full((270, 480, 3), 128, np.uint8) for _ in range(5)]
    camera = Camera(textured.LENS)
    assert carried.follow(camera, textured.views(blank)).camera is camera
    shifts = np.array([[0.0, 30.0, 30.0, 30.0]]).T[:, :, None] * np.array([[0, 0, 1], [0, 0, 0], [0, 0, 0]])
    moves = Views(np.eye(3) + shifts, np.array([1.0, 0.8, 0.0, 0.0]))
    found = carried.follow(camera, moves)
    assert found.camera.path is not None  # half of the frames are enough
    lost = carried.follow(camera, replace(moves, shares=np.array([0.0, 0.8, 0.0, 0.0])))
    assert lost.camera is camera
    assert "taken for still: its background could not be followed in 3 of 4 frames" in lost.notes[0]
