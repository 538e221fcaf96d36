"""A camera that nobody knows: of evidence that has one, and of files that have none."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from simrecon.errors import InputError
from simrecon.evidence import unknown_camera
from simrecon.geometry import camera as cameras
from simrecon.types import Camera, Evidence, Lens
from tests.support.reading import observed


def seen(camera: Camera | None) -> Evidence:
    pixels, scores = np.zeros((3, 1, 2)), np.ones((3, 1))
    return Evidence(
        np.arange(3) / 30, ("nose",), pixels, scores, (), np.empty((3, 0, 3)), "world", camera=camera
    )


def test_lens_and_place_are_hidden() -> None:
    matrix = np.array([[900.0, 0, 500], [0, 900.0, 300], [0, 0, 1]])
    hidden = unknown_camera(
        seen(cameras.still(Lens(matrix, np.full(5, 0.1), (800, 600)), np.eye(4), 3))
    ).camera
    assert hidden is not None
    focal = 400 / np.tan(np.radians(54.4 / 2))
    np.testing.assert_allclose(hidden.lens.matrix_px, [[focal, 0, 399.5], [0, focal, 299.5], [0, 0, 1]])
    assert hidden.lens.focal_sigma == 0.245
    assert not hidden.lens.distortion.any()
    assert hidden.path is None


def test_landmarks_need_an_image_size() -> None:
    with pytest.raises(InputError, match="--size"):
        unknown_camera(seen(None))


@pytest.fixture
def keypoints(tmp_path: Path) -> Path:
    """Two frames of COCO's 17 points, of which no file says through which lens they were seen."""
    points = np.arange(51, dtype=float).reshape(17, 3)
    points[:, 2] = 0.9
    frames = [
        {"image_id": f"{frame}.jpg", "category_id": 1, "keypoints": points.ravel().tolist(), "score": 2.0}
        for frame in range(2)
    ]
    path = tmp_path / "alphapose.json"
    path.write_text(json.dumps(frames), encoding="utf-8")
    return path


def test_landmarks_of_an_unknown_lens_need_only_the_size_of_the_image(keypoints: Path) -> None:
    size = ("--fps", "30", "--size", "800x600")
    with pytest.raises(InputError, match="no lens"):
        observed(keypoints, *size)
    found = observed(keypoints, *size, "--unknown-camera")
    assert found.camera is not None
    assert found.camera.lens.matrix_px[0, 0] == pytest.approx(400 / np.tan(np.radians(54.4 / 2)))
    assert found.camera.lens.image_size_px == (800, 600)


def test_the_size_of_a_video_will_do(keypoints: Path) -> None:
    video = Path(__file__).parents[2] / "simrecon" / "example" / "beam.mp4"
    found = observed(keypoints, "--video", str(video), "--unknown-camera")
    assert found.camera is not None
    width, height = found.camera.lens.image_size_px
    assert height > width  # only phones are held so
    assert found.camera.lens.matrix_px[0, 0] == pytest.approx(height / 2 / np.tan(np.radians(65 / 2)))
    assert found.camera.lens.focal_sigma == 0.15
