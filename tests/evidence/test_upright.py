"""Turned images, and pixels that are not square."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from simrecon import evidence, resources
from simrecon.drawing import overlay, video
from simrecon.errors import InputError
from simrecon.evidence import Options, upright
from simrecon.evidence.video import detection, frames, weights
from simrecon.geometry import camera as cameras
from simrecon.job import Job, Reading, inputs
from simrecon.types import Camera, Evidence, Lens
from tests.support import video_files as files
from tests.support.reading import observed

MATRIX = np.array([[150.0, 0, 83], [0, 140, 61], [0, 0, 1]])
DISTORTED = np.array([0.1, -0.05, 0.01, -0.02, 0.003])


@pytest.fixture
def networks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Instead of BlazePose, with weights that are only names."""
    monkeypatch.setenv("SIMRECON_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(weights, "find", lambda name: (Path(name), name))
    monkeypatch.setattr(detection, "Networks", lambda *_: files.Rectangles())


@pytest.mark.parametrize("turn", [0, 90, 180, 270])
@pytest.mark.parametrize("aspect", [1.0, 16 / 11])
def test_what_the_turned_camera_sees_is_the_turned_image(turn: int, aspect: float) -> None:
    rng = np.random.default_rng(0)
    path = np.broadcast_to(np.eye(4), (5, 4, 4))
    camera = Camera(Lens(MATRIX, DISTORTED, (160, 120)), path)
    points = rng.uniform([-0.4, -0.3, 1.0], [0.4, 0.3, 2.0], (5, 3, 3))
    pixels = cameras.project(camera, points)
    seen = Evidence(
        times_s=np.arange(5) / 30,
        keypoint_names=("a", "b", "c"), keypoints_px=pixels, scores=np.ones((5, 3)),
        joint_names=("a", "b", "c"), joints_m=points, joints_frame="camera", camera=camera,
    )  # fmt: skip
    found = upright.upright(seen, turn, aspect)
    assert found.camera is not None
    np.testing.assert_allclose(cameras.project(found.camera, points), found.keypoints_px, atol=1e-9)
    bare = replace(found.camera, path=path)
    np.testing.assert_allclose(cameras.project(bare, found.joints_m), found.keypoints_px, atol=1e-9)
    image = np.zeros((120, 160), np.uint8)
    image[40, 30] = 255
    if aspect == 1.0 and turn:
        codes = {90: cv2.ROTATE_90_CLOCKWISE, 180: cv2.ROTATE_180, 270: cv2.ROTATE_90_COUNTERCLOCKWISE}
        row, column = np.argwhere(cv2.rotate(image, codes[turn]))[0]
        one = upright.upright(replace(seen, keypoints_px=np.full((5, 3, 2), [30.0, 40.0])), turn)
        np.testing.assert_array_equal(one.keypoints_px[0, 0], [column, row])
    back = upright.stored(found.camera, turn, aspect)
    np.testing.assert_allclose(back.lens.matrix_px, MATRIX)
    np.testing.assert_allclose(back.lens.distortion, DISTORTED)
    assert back.lens.image_size_px == (160, 120)


def test_landmarks_of_a_turned_video_become_those_of_the_upright_one(tmp_path: Path) -> None:
    given = evidence.read(resources.folder("example") / "beam.npz")
    assert given.camera is not None
    given = replace(given, camera=Camera(given.camera.lens))
    lying = upright.upright(given, 270)
    evidence.write(tmp_path / "lying.npz", lying)
    said = evidence.read(tmp_path / "lying.npz", Options())
    assert "with the head to the left" in said.reading
    found = observed(tmp_path / "lying.npz", "--rotate", "90")
    np.testing.assert_allclose(found.keypoints_px, given.keypoints_px)
    np.testing.assert_allclose(found.joints_m, given.joints_m)
    assert found.camera is not None
    np.testing.assert_allclose(found.camera.lens.matrix_px, given.camera.lens.matrix_px)  # type: ignore[union-attr]
    assert found.reading == "simrecon evidence; turned by 90°"
    lens = observed(tmp_path / "lying.npz", "--rotate", "90", "--fov", "40")  # of the upright image
    assert lens.camera is not None
    width = given.camera.lens.image_size_px[0]  # type: ignore[union-attr]
    assert lens.camera.lens.matrix_px[0, 0] == pytest.approx(width / 2 / np.tan(np.radians(20)))


@pytest.mark.usefixtures("networks")
def test_a_turned_video_is_detected_and_drawn_on_upright(tmp_path: Path) -> None:
    images = [files.scene([(40 + 2 * t, 60, 80, files.RED)]) for t in range(8)]
    plain = files.write(tmp_path / "plain.mp4", images)
    turned = files.write(tmp_path / "turned.mp4", [cv2.rotate(i, cv2.ROTATE_90_CLOCKWISE) for i in images])
    whole = inputs.observe(Job(str(plain), "", reading=Reading(fov_deg=50.0)))
    found = inputs.observe(Job(str(turned), "", reading=Reading(fov_deg=50.0, rotate=270)))
    np.testing.assert_allclose(found.keypoints_px, whole.keypoints_px, atol=1.0)
    assert "160 x 120 px (turned by 270° as told)" in found.reading
    overlay.check_video(turned, found, 270)
    with pytest.raises(InputError, match="the aspect ratio must be the same"):
        overlay.check_video(turned, found)
    drawn = next(video.frames(turned, found.times_s, turn_deg=270))
    assert np.abs(drawn.astype(int) - images[0]).mean() < 6


@pytest.mark.usefixtures("networks")
def test_pixels_that_are_not_square_are_made_so(tmp_path: Path) -> None:
    images = [files.scene([(40 + 2 * t, 60, 80, files.RED)]) for t in range(8)]
    path = files.write(tmp_path / "wide.mp4", images)
    files.widen(path, 3, 2)
    assert frames.probe(path).size_px == (240, 120)
    assert frames.probe(path, 90).size_px == (120, 240)
    assert next(frames.frames(path, turn_deg=90)).image.shape == (240, 120, 3)
    found = inputs.observe(Job(str(path), "", reading=Reading(fov_deg=50.0)))
    assert "240 x 120 px (pixels 1.5 times as wide as high made square)" in found.reading
    middle = found.keypoints_px[:, [11, 12], 0].mean(axis=1)
    np.testing.assert_allclose(middle, 1.5 * (40 + 2 * np.arange(8)), atol=1.5)
    overlay.check_video(path, found)


@pytest.mark.usefixtures("networks")
def test_a_calibration_may_be_of_the_stored_image(tmp_path: Path) -> None:
    path = files.write(tmp_path / "wide.mp4", [files.scene([(60, 60, 80, files.RED)])] * 4)
    files.widen(path, 3, 2)
    camera = tmp_path / "camera.toml"
    for text, wide in (
        ("image_size_px = [160, 120]\nmatrix_px = [[150, 0, 80], [0, 225, 60], [0, 0, 1]]\n", 225.0),
        ("image_size_px = [240, 120]\nmatrix_px = [[220, 0, 120], [0, 220, 60], [0, 0, 1]]\n", 220.0),
    ):
        camera.write_text(text)
        found = inputs.observe(Job(str(path), "", reading=Reading(camera=str(camera))))
        assert found.camera is not None
        assert found.camera.lens.image_size_px == (240, 120)
        assert found.camera.lens.matrix_px[0, 0] == wide
    camera.write_text("image_size_px = [120, 120]\nfocal_px = 150\n")
    with pytest.raises(InputError, match="a camera of 120 x 120 px for images of 160 x 120; valid: the same"):
        inputs.observe(Job(str(path), "", reading=Reading(camera=str(camera))))


def test_landmarks_of_an_anamorphic_video_are_stretched_with_it(tmp_path: Path) -> None:
    path = files.write(tmp_path / "wide.mp4", [files.scene([])] * 8)
    files.widen(path, 3, 2)
    given = evidence.read(resources.folder("example") / "beam.npz")
    columns = [given.keypoint_names.index(name) for name in ("left_hip", "right_shoulder", "left_ankle")]
    points = np.array([[60.0, 70], [64, 30], [58, 110]])
    camera = Camera(Lens(MATRIX, np.zeros(5), (160, 120)))
    seen = evidence.from_arrays(
        np.arange(8) / 30,
        keypoint_names=[given.keypoint_names[i] for i in columns],
        keypoints_px=np.tile(points, (8, 1, 1)),
        camera=camera,
    )
    evidence.write(tmp_path / "stored.npz", seen)
    found = observed(tmp_path / "stored.npz", "--video", str(path))
    np.testing.assert_allclose(found.keypoints_px[0], points * [1.5, 1] + [0.25, 0])
    assert found.camera is not None
    assert found.camera.lens.image_size_px == (240, 120)
    evidence.write(tmp_path / "square.npz", upright.upright(seen, 0, 1.5))
    again = observed(tmp_path / "square.npz", "--video", str(path))  # was made of square pixels
    np.testing.assert_allclose(again.keypoints_px, found.keypoints_px)


@pytest.mark.parametrize("word", ["100", "45", "0", "360", "-90", "left"])
def test_other_turns_are_refused_with_those_that_are_valid(word: str) -> None:
    with pytest.raises(InputError, match=f"--rotate: must be 90, 180 or 270, found '{word}'"):
        observed(resources.folder("example") / "beam.npz", "--rotate", word)


def test_motion_capture_is_not_turned() -> None:
    case = Path(__file__).parents[1] / "data" / "cases" / "bvh_height_1m71.bvh"
    with pytest.raises(InputError, match="--rotate: found 90, which has no meaning for the format bvh"):
        observed(case, "--rotate", "90")
