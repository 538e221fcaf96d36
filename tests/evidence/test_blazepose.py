from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simrecon.evidence.video import blazepose, candidates
from simrecon.evidence.video.blazepose import Region


def logit(p: float) -> float:
    return float(np.log(p / (1 - p)))


def test_anchors_are_those_of_the_network() -> None:
    centres = candidates.anchors()
    assert centres.shape == (2254, 2)
    np.testing.assert_allclose(centres[:2], 0.5 / 28)  # two in the first cell of 8 px
    np.testing.assert_allclose(centres[2], [1.5 / 28, 0.5 / 28])  # x runs first
    np.testing.assert_allclose(centres[2 * 28 * 28], 0.5 / 14)
    np.testing.assert_allclose(centres[2 * 28 * 28 + 2 * 14 * 14 + 5], 0.5 / 7)  # six per cell of 32 px
    np.testing.assert_allclose(centres[-1], 6.5 / 7)


def test_candidates_are_decoded_around_their_anchors() -> None:
    centres = candidates.anchors()
    raw, scores = np.zeros((2254, 12)), np.full(2254, -50.0)
    scores[[10, 700, 900]] = [logit(0.6), logit(0.9), logit(0.4)]
    raw[700] = [22.4, -22.4, 44.8, 89.6, *range(8)]
    found = candidates.decode_candidates(raw, scores, centres)
    assert found.shape == (2, 13)  # 0.4 is below the threshold; the best comes first
    np.testing.assert_allclose(found[:, -1], [0.9, 0.6])
    x, y = centres[700]
    np.testing.assert_allclose(found[0, :4], [x + 0.1 - 0.1, y - 0.1 - 0.2, x + 0.1 + 0.1, y - 0.1 + 0.2])
    np.testing.assert_allclose(found[0, 4:12], np.arange(8) / 224 + np.tile([x, y], 4))


def test_scores_far_beyond_the_clip_are_no_overflow() -> None:
    with np.errstate(all="raise"):
        np.testing.assert_allclose(blazepose.sigmoid(np.array([-1e9, 0.0, 1e9])), [0.0, 0.5, 1.0], atol=1e-40)


def test_weighted_suppression_means_the_overlapping_and_keeps_the_others() -> None:
    def row(x: float, score: float) -> list[float]:
        return [x, 0.0, x + 0.2, 0.2, *[x] * 8, score]

    found = candidates.suppress(np.array([row(0.10, 0.9), row(0.14, 0.6), row(0.5, 0.55)]))
    assert len(found) == 2
    np.testing.assert_allclose(found[0, 0], (0.9 * 0.10 + 0.6 * 0.14) / 1.5)
    assert found[0, -1] == 0.9
    np.testing.assert_allclose(found[1], row(0.5, 0.55))
    assert candidates.suppress(np.empty((0, 13))).shape == (0, 13)


def test_suppression_ends_with_boxes_of_no_size() -> None:
    assert len(candidates.suppress(np.tile(np.append(np.zeros(12), 0.7), (3, 1)))) == 3


@pytest.mark.parametrize(("edge", "angle"), [((0, -1), 0), ((1, 0), 90), ((0, 1), -180), ((-1, 0), -90)])
def test_region_is_turned_with_the_person(edge: tuple[int, int], angle: int) -> None:
    region = blazepose.align(np.array([50.0, 40.0]), np.array([50.0, 40.0]) + 20 * np.array(edge, float))
    np.testing.assert_allclose(np.degrees(region.angle_rad), angle, atol=1e-9)
    assert region.side_px == pytest.approx(2 * 20 * 1.25)
    top = region.matrix(1) @ [0.5, 0.1, 1.0]  # above the middle of the crop is towards the edge point
    np.testing.assert_allclose(top, np.array([50, 40]) + 0.4 * 50 * np.array(edge), atol=1e-9)


@given(st.integers(1, 4000), st.integers(1, 4000))
def test_letterbox_round_trip(width: int, height: int) -> None:
    scale, bars = candidates.letterbox(width, height, 224)
    corner = np.array([width, height]) / scale + bars  # in the network's input
    np.testing.assert_allclose(corner + bars, 224)
    assert (bars >= -1e-9).all()
    assert bars.min() == pytest.approx(0, abs=1e-9)


def test_candidates_of_a_tile_come_back_to_the_image() -> None:
    tile = (100.0, 30.0, 448.0, 224.0)  # two image pixels per input pixel, bars of 56 above and below
    points = np.array([[0, 56], [224, 168], [112, 112], [112, 62], [0, 0], [0, 0]]) / 224
    (found,) = candidates.to_candidates(np.append(points.ravel(), 0.8)[None], tile)
    np.testing.assert_allclose(found.box_px, [100, 30, 548, 254])
    np.testing.assert_allclose(found.region.centre_px, [324, 142])
    assert found.region.side_px == pytest.approx(2 * 100 * 1.25)
    assert found.region.angle_rad == pytest.approx(0)


def test_crop_takes_the_pixels_that_its_matrix_names(rng: np.random.Generator) -> None:
    noise = rng.integers(0, 255, (300, 400, 3), np.uint8)
    image = np.asarray(cv2.GaussianBlur(noise, (0, 0), 6), np.uint8)
    region = Region(np.array([180.0, 150.0]), 128.0, np.radians(30))
    made = blazepose.crop(image, region, 64)
    for i, j in ((10, 50), (32, 32), (60, 7)):
        x, y = region.matrix(64) @ [j + 0.5, i + 0.5, 1.0] - 0.5
        wanted = cv2.getRectSubPix(image, (1, 1), (float(x), float(y)))[0, 0]
        assert np.abs(made[i, j].astype(int) - wanted).max() <= 4
    beyond = blazepose.crop(image, Region(np.array([-200.0, -200.0]), 100.0, 0.0), 32)
    assert not beyond.any()


def test_refinement_moves_to_the_heat() -> None:
    heat = np.full((64, 64, 3), -50.0)
    heat[20, 11, 0] = heat[20, 12, 0] = 50.0  # row 20, columns 11 and 12
    heat[40, 40, 1] = logit(0.4)  # too cold
    points = np.array([[10.5, 21.5], [40.2, 40.2], [-3.0, 70.0]]) / 64
    found = blazepose.refine(points, heat)
    np.testing.assert_allclose(found[0] * 64, [11.5, 20.0])
    np.testing.assert_allclose(found[1:], points[1:])


def test_heat_far_away_does_not_count() -> None:
    heat = np.full((64, 64, 1), -50.0)
    heat[10, 10, 0] = heat[10, 20, 0] = 50.0
    np.testing.assert_allclose(blazepose.refine(np.array([[10.0, 10.0]]) / 64, heat) * 64, [[10, 10]])


def test_pose_is_mapped_into_the_image() -> None:
    raw = np.zeros((39, 5))
    raw[:, :2] = 128.0  # the middle of the crop
    raw[33, :2], raw[34, :2] = [128, 128], [128, 28]  # next region: 100 px of the crop above its middle
    raw[:, 3], raw[:, 4] = logit(0.8), logit(0.5)
    world = np.zeros((39, 3))
    world[0] = [0, -1, 0.3]
    region = Region(np.array([500.0, 300.0]), 512.0, np.radians(90))
    pose = blazepose.decode_pose(raw, 0.97, None, world, region)
    np.testing.assert_allclose(pose.points_px, np.tile([500, 300], (33, 1)))
    np.testing.assert_allclose(pose.scores, 0.4)
    np.testing.assert_allclose(
        pose.world_m[0], [1, 0, 0.3], atol=1e-12
    )  # upright in the crop, lying in the image
    np.testing.assert_allclose(pose.region.centre_px, [500, 300])
    assert pose.region.side_px == pytest.approx(2 * 200 * 1.25)
    assert pose.region.angle_rad == pytest.approx(np.radians(90))
