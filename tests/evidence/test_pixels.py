"""Coordinates that are no pixels, or those of another image."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from simrecon import evidence
from simrecon.errors import InputError
from simrecon.evidence import Options
from simrecon.evidence.camera import fov
from simrecon.evidence.keypoints import layouts
from simrecon.types import Evidence
from tests.support import foreign_files as foreign
from tests.support import people

SIZE = np.array([1080.0, 1920.0])
NAMES = layouts.layout("coco_17")
POINTS = 3.5 * people.landmarks(NAMES) + [-600.0, 100.0]  # (T, J, 2), high in an upright image


def results(folder: Path, points: np.ndarray, third: np.ndarray | None = None) -> Path:
    scores = np.full((*points.shape[:2], 1), 0.9) if third is None else third
    values = np.concatenate((points, scores), axis=-1)
    tree = [{"image_id": t, "keypoints": row.ravel().tolist(), "score": 1.0} for t, row in enumerate(values)]
    return foreign.save_json(folder / "results.json", tree)


def read(path: Path, size: tuple[int, int] = (1080, 1920)) -> Evidence:
    return evidence.read(path, Options(fps=30.0, camera=fov.pinhole(1500.0, size)))


def test_shares_of_the_image_become_pixels(tmp_path: Path) -> None:
    path = results(tmp_path, POINTS / SIZE)
    found = read(path)
    np.testing.assert_allclose(found.keypoints_px, POINTS, atol=1e-6)
    assert "coordinates from 0 to 1 taken as shares of 1080 x 1920 px" in found.reading
    with pytest.raises(
        InputError, match="from 0 to 1, shares of the image's sides; valid: --size WIDTHxHEIGHT"
    ):
        evidence.read(path, Options(fps=30.0))


def test_coordinates_around_the_middle_are_known_of_openpose_only(tmp_path: Path) -> None:
    points = 3.5 * people.landmarks(layouts.layout("openpose_25")) + [-600.0, 100.0]
    for t, row in enumerate(2 * points / SIZE - 1):
        values = np.concatenate((row, np.ones((25, 1))), axis=-1)
        foreign.save_json(
            tmp_path / f"{t}.json", {"people": [{"pose_keypoints_2d": values.ravel().tolist()}]}
        )
    found = read(tmp_path)
    keep = [i for i, name in enumerate(layouts.layout("openpose_25")) if name]
    np.testing.assert_allclose(found.keypoints_px, points[:, keep], atol=1e-6)
    assert "coordinates from -1 to 1" in found.reading
    with pytest.raises(InputError, match="valid: pixels of the image, or shares"):
        read(results(tmp_path, 2 * POINTS / SIZE - 1))


def in_space(scale: float) -> np.ndarray:
    return scale * people.named(people.walking(), NAMES)


NO_PIXELS: dict[str, tuple[Callable[[], tuple[np.ndarray, np.ndarray | None]], str]] = {
    "metres": (lambda: (in_space(1.0)[..., 1:] * [1, -1], None), "a person 1"),
    "depths for scores": (
        lambda: (in_space(100.0)[..., :2], in_space(100.0)[..., 2:]),
        "which are no confidences",
    ),
    "beyond any image": (lambda: (POINTS * 1e5, None), "px away"),
}


@pytest.mark.parametrize("name", NO_PIXELS)
def test_what_is_no_pixels_is_refused(tmp_path: Path, name: str) -> None:
    make, words = NO_PIXELS[name]
    with pytest.raises(InputError) as raised:
        read(results(tmp_path, *make()))
    assert words in str(raised.value)
    assert "\n" not in str(raised.value)


def test_landmarks_of_an_image_of_another_size_are_refused(tmp_path: Path) -> None:
    path = results(tmp_path, POINTS + np.array([0.0, 300.0]))
    with pytest.raises(
        InputError, match=r"in an image of 1920x1080; valid: --size 1080x1920, width and height exch"
    ):
        read(path, (1920, 1080))
    with pytest.raises(InputError, match=r"in an image of 640x480; valid: --size of the images they are of"):
        read(path, (640, 480))


def test_doubts_about_the_image_are_said(tmp_path: Path) -> None:
    assert "image" not in read(results(tmp_path, POINTS)).reading
    lower = POINTS * [1.0, 0.85]
    assert (
        "of 1080x1920: are width and height exchanged?"
        in read(results(tmp_path, lower), (1920, 1080)).reading
    )
    assert (
        "the upper left of an image of 2400x4200 only"
        in read(results(tmp_path, POINTS), (2400, 4200)).reading
    )


def test_a_person_who_never_stands_is_said(tmp_path: Path) -> None:
    assert "makes it upright" not in read(results(tmp_path, POINTS)).reading
    across = "lies across the image, with the head to the"
    turned = POINTS[..., ::-1]
    said = read(results(tmp_path, turned), (1920, 1080)).reading.splitlines()[-1]
    hint = "if the video is turned, --rotate 90 makes it upright"
    assert said == f"the person {across} left in 100% of the frames: {hint}"
    right = SIZE[::-1] * [1, 0] + turned * [-1, 1]
    assert f"{across} right" in read(results(tmp_path, right), (1920, 1080)).reading
    upside = SIZE * [0, 1] + POINTS * [1, -1]
    found = read(results(tmp_path, upside)).reading
    assert "stands on the head in the image in 100% of the frames" in found
    assert "--rotate 180" in found


def test_movenets_arrays_have_y_first(tmp_path: Path) -> None:
    values = np.concatenate((POINTS / SIZE, np.full((30, 17, 1), 0.7)), axis=-1)[:, None, None, :, [1, 0, 2]]
    np.save(tmp_path / "movenet.npy", values)
    found = read(tmp_path / "movenet.npy")
    np.testing.assert_allclose(found.keypoints_px, POINTS, atol=1e-6)
    assert "y before x" in found.reading


def test_a_dataset_states_the_size_of_its_images(tmp_path: Path) -> None:
    images = [{"id": t, "file_name": f"{t}.jpg", "width": 1080, "height": 1920} for t in range(30)]
    annotations = [
        {"image_id": t, "keypoints": np.concatenate((row, np.full((17, 1), 2.0)), axis=1).ravel().tolist()}
        for t, row in enumerate(POINTS)
    ]
    path = foreign.save_json(tmp_path / "dataset.json", {"images": images, "annotations": annotations})
    np.testing.assert_allclose(read(path).keypoints_px, POINTS)
    with pytest.raises(InputError, match="images: found 1080 x 1920 px for a lens of 1920 x 1080 px"):
        read(path, (1920, 1080))
