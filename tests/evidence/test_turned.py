"""People who turn over: candidates of turned crops, where a spin goes on, and anchors that correct a pass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon.evidence.video import figures, jumps, turned
from simrecon.evidence.video.blazepose import Pose, Region
from simrecon.evidence.video.candidates import DETECTOR_SIDE, Candidate
from simrecon.evidence.video.passes import Passes
from simrecon.evidence.video.tracker import Choice, Tracker
from tests.support import video_files as files
from tests.support.video_files import RED

RATE = 30


@pytest.mark.parametrize("angle", [0.0, 0.7, -2.0])
def test_a_candidate_of_a_crop_is_where_it_is_in_the_image(angle: float) -> None:
    part = Region(np.array([300.0, 200.0]), 400.0, angle)
    middle = np.full(2, DETECTOR_SIDE / 2)
    inside = Candidate(0.9, np.zeros(4), Region(middle - np.array([0.0, 56.0]), 112.0, 0.3))
    found = turned.placed(inside, part).region
    up = np.array([np.sin(angle), -np.cos(angle)])
    np.testing.assert_allclose(found.centre_px, part.centre_px + 100.0 * up)
    assert found.side_px == pytest.approx(200.0)
    assert found.angle_rad == pytest.approx(angle + 0.3)


class Spinning(files.Rectangles):
    """Sees somebody clearly only if the region is turned nearly as they are."""

    def __init__(self) -> None:
        super().__init__()
        self.angle_rad, self.asked = 0.0, list[float]()

    def pose(self, image: np.ndarray, region: Region) -> Pose:
        self.asked.append(region.angle_rad)
        pose = super().pose(image, region)
        clear = np.cos(region.angle_rad - self.angle_rad) > 0.9
        own = replace(pose.region, angle_rad=self.angle_rad if clear else region.angle_rad)
        return replace(pose, scores=np.full(33, 0.9 if clear else 0.2), region=own)

    def candidates(self, image: np.ndarray, tile: tuple[int, int, int, int] | None = None) -> list[Candidate]:
        if image.shape[:2] != (DETECTOR_SIDE, DETECTOR_SIDE):
            return super().candidates(image, tile)
        inside = Region(np.full(2, DETECTOR_SIDE / 2), DETECTOR_SIDE / turned.AROUND, 0.0)
        return [Candidate(0.9, np.zeros(4), inside)]


def test_who_turns_at_once_is_found_at_another_angle() -> None:
    network = Spinning()
    made = Tracker(network, Choice())
    image = files.scene([(80, 60, 80, RED)])
    assert made.step(image, 0.0) is not None
    network.angle_rad = np.pi / 2
    found = made.step(image, 1 / RATE)
    assert found is not None
    assert figures.clarity(found) == pytest.approx(0.9)
    assert found.region.angle_rad == pytest.approx(np.pi / 2)


def test_a_spin_is_expected_to_go_on() -> None:
    network = Spinning()
    made = Tracker(network, Choice())
    for t in range(6):
        network.angle_rad = 0.35 * t
        assert made.step(files.scene([(60 + 8 * t, 60, 80, RED)]), t / RATE) is not None
    assert network.asked[-1] == pytest.approx(network.angle_rad)
    assert made.losses == 0


def test_a_landmark_that_jumps_away_and_back_is_not_believed() -> None:
    times = np.arange(8) / RATE
    points = np.zeros((8, 33, 2))
    points[:, :, 0] = 12.0 * np.arange(8)[:, None]  # 100 px per m: 3.6 m/s
    points[3, 7, 1] = 60.0
    points[5:, 9, 1] = 60.0  # does not come back
    points[6, 11] = np.nan
    found = jumps.find(times, points, np.full(8, 100.0))
    assert np.argwhere(found).tolist() == [[3, 7]]
    assert not jumps.find(10 * times, points, np.full(8, 100.0)).any()  # who knows what was in between
    assert not jumps.find(times[:2], points[:2], np.full(2, 100.0)).any()


def test_an_anchor_corrects_the_forward_pass_back_to_where_both_agree() -> None:
    """A tracker that takes a part of the person for the whole, until somebody knows better."""

    class Deceived(files.Rectangles):
        small = False

        def pose(self, image: np.ndarray, region: Region) -> Pose:
            pose = super().pose(image, region)
            share = 0.6 if self.small and region.side_px < 100 else 1.0
            return replace(pose, region=replace(pose.region, side_px=share * pose.region.side_px))

    network = Deceived()
    tracker = Tracker(network, Choice())
    passes, found = Passes(tracker), dict[int, Pose | None]()
    clip = [files.scene([(40.0 + t, 60, 80, RED)] if t != 5 else []) for t in range(14)]
    anchor = files.Rectangles().pose(clip[12], Region(np.array([52.0, 60.0]), 104.0, 0.0))
    for t, image in enumerate(clip):
        network.small = 6 <= t < 12
        found |= passes.step(t, image, t / RATE, anchor if t == 12 else None)
    assert found[5] is not None
    assert np.isnan(found[5].world_m).all()  # nobody is there: bridged
    sides = [pose.region.side_px for t, pose in sorted(found.items()) if pose is not None]
    np.testing.assert_allclose(sides, sides[0], rtol=0.05)
