from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from simrecon.errors import InputError
from simrecon.evidence.video import detection, weights
from simrecon.evidence.video.blazepose import NAMES
from simrecon.evidence.video.detection import Look
from tools.bench import tracking

SIZES = {tracking.FIRST: (1080, 1920), tracking.SECOND: (1088, 1920)}


@pytest.mark.parametrize("name", SIZES)
def test_landmarks_of_sixty_frames(name: str) -> None:
    rows, columns, points = tracking.read(tracking.LANDMARKS / f"{name}.csv")
    assert points.shape == (60, 12, 2)
    assert (np.diff(rows) > 0).all()
    assert rows[0] == 0
    assert rows[-1] == 99
    assert NAMES[columns[0]] == "left_shoulder"
    assert np.isfinite(points).mean() > 0.8
    assert (np.nan_to_num(points) >= 0).all()
    assert (np.nan_to_num(points) < SIZES[name]).all()


def test_right_and_wrong_frames() -> None:
    true = np.tile([[0.0, 0.0], [10.0, 78.0]], (4, 1, 1))  # of somebody 100 px high
    found = true + np.array([0.0, 9.0, 15.0, 40.0])[:, None, None] / np.sqrt(2)
    tall = tracking.heights_px(true)
    np.testing.assert_allclose(tall, 100.0)
    assert tracking.score(found, true, tall) == (0.5, 0.25)
    found[0] = np.nan
    assert tracking.score(found, true, tall) == (0.25, 0.25)


@pytest.mark.parametrize(("turn", "place"), [(90, (279.0, 10.0)), (180, (469.0, 99.0))])
def test_places_in_a_turned_image(turn: int, place: tuple[float, float]) -> None:
    points = np.array([[[10.0, 200.0]]])
    size = (480, 480) if turn == 90 else (480, 300)
    np.testing.assert_array_equal(tracking.turned_px(points, turn, size)[0, 0], place)


@pytest.mark.slow
@pytest.mark.parametrize("name", SIZES)
def test_the_right_person_is_followed(name: str, shared_data: Path) -> None:
    if importlib.util.find_spec("ai_edge_litert") is None:
        pytest.skip("needs the extra `video`")
    from simrecon.evidence.video.networks import Networks

    try:
        network = Networks(weights.find("detector")[0], weights.find("heavy")[0])
    except InputError:
        pytest.skip("needs the network weights (simrecon models fetch)")
    rows, columns, points = tracking.read(tracking.LANDMARKS / f"{name}.csv")
    followed = detection.follow(shared_data / "video" / f"{name}.mp4", network, Look())
    found = followed.points_px[rows][:, columns]
    assert tracking.score(found, points, tracking.heights_px(points)) == (1.0, 0.0)
