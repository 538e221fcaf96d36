from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simrecon.evidence.cutting import WHOLE
from simrecon.evidence.video import figures, searching, survey
from simrecon.evidence.video.blazepose import Pose, Region
from simrecon.evidence.video.passes import Passes
from simrecon.evidence.video.tracker import Choice, Tracker
from tests.support import video_files as files
from tests.support.video_files import BLUE, GREEN, RED, Person

RATE = 30
LARGEST = Choice()


def follow(clips: Sequence[Sequence[Person]], choice: Choice = LARGEST) -> tuple[Tracker, list[float | None]]:
    made = Tracker(files.Rectangles(), choice)
    places: list[float | None] = []
    for t, people in enumerate(clips):
        pose = made.step(files.scene(people), t / RATE)
        places.append(None if pose is None else figures.middle(pose)[0])
    return made, places


def known(places: list[float | None]) -> list[float]:
    """Places where somebody was found, in all frames."""
    found = [place for place in places if place is not None]
    assert len(found) == len(places)
    return found


def test_follows_without_detecting_again() -> None:
    network = files.Rectangles()
    made = Tracker(network, Choice())
    assert all(made.step(files.scene([(40 + t, 60, 80, RED)]), t / RATE) is not None for t in range(30))
    first = network.calls["candidates"]
    assert first <= 1 + len(searching.tiles(160, 120))
    assert made.losses == 0


def test_the_largest_person_is_the_one_that_is_seen_largest() -> None:
    class Deceived(files.Rectangles):
        """Takes the region of the smaller person for far too large, as networks do of someone cut off."""

        def pose(self, image: np.ndarray, region: Region) -> Pose:
            pose = super().pose(image, region)
            share = 4.0 if pose.region.centre_px[0] > 80 else 1.0
            return replace(pose, region=replace(pose.region, side_px=share * pose.region.side_px))

    image = files.scene([(40, 60, 100, RED), (130, 60, 40, GREEN)])
    found = searching.people(Deceived(), image)
    assert [round(figures.middle(pose)[0]) for pose in found] == [40, 130]


def test_people_are_described_by_place_and_mean_size() -> None:
    lying = np.array([[3, 0, 10.0, 50, 150, 90], [7, 0, 10, 50, 170, 90], [3, 1, 100, 20, 120, 100]])
    said = survey.described(lying, 4)
    assert said == (
        "1 (at 80,70 in frame 3, 150 px wide, in 2 of 4), 2 (at 110,60 in frame 3, 80 px high, in 1 of 4)"
    )
    assert survey.described(np.zeros((0, 6)), 4) == ""


def test_the_person_who_is_seen_best_over_the_clip_is_number_one(tmp_path: Path) -> None:
    """Not the largest of the first frame, who soon leaves, and not the one who only stands there."""
    clips = [
        [(30, 60, 70, GREEN), (100, 60, 60, RED)] if t < 6 else [(60 + 2 * t, 60, 60, RED)] for t in range(32)
    ]
    for people in clips:
        people.append((140, 40, 62, BLUE))
    path = files.write(tmp_path / "clip.mp4", [files.scene(people) for people in clips])
    there = survey.survey(path, files.Rectangles(), WHOLE, 32)
    assert len(there.rows) == 16
    assert [len(person) for person in there.people] == [16, 16, 3]
    assert [round(figures.middle(person[0].pose)[0]) for person in there.people] == [100, 140, 30]
    index, first = there.at(31, 60) or (None, None)
    assert index == 2
    assert first is not None
    assert first.row == 0
    assert there.at(5, 5) is None


def test_what_is_not_of_one_mind_with_its_3d_estimate_is_no_person() -> None:
    network, image = files.Rectangles(), files.scene([(60, 60, 80, RED)])
    (pose,) = searching.people(network, image)
    assert figures.is_person(pose)
    assert not figures.is_person(replace(pose, scores=np.full(33, 0.2)))
    turned = replace(pose, world_m=pose.world_m[:, [1, 0, 2]])
    assert figures.misfit(turned) > figures.MISFIT_MAX > figures.misfit(pose)
    assert not figures.is_person(turned)


def test_what_was_lost_is_followed_backward_from_where_the_person_is_found_again() -> None:
    """Somebody who hurries through a dark frame is too far away forward, and near enough backward."""
    path = [(40.0, 80)] * 5 + [(40.0, 30)] * 3 + [(44.0 + t, 80) for t in range(12)]
    passes = Passes(Tracker(files.Rectangles(), Choice()))
    found: dict[int, Pose | None] = {}
    for t, (x, height) in enumerate(path):
        found |= passes.step(t, files.scene([(x, 60, height, RED)]), t / RATE)
    assert passes.found_backward == 0
    assert [t for t in found if found[t] is None] == [5, 6, 7]
    late = Passes(Tracker(files.Rectangles(), Choice()))
    (begin,) = searching.people(files.Rectangles(), files.scene([(59.0, 60, 80, RED)]))
    found = {}
    for t in range(20):
        image = files.scene([(40.0 + t, 60, 80, RED)])
        found |= late.step(t, image, t / RATE, begin if t == 19 else None, waits=True)
    assert late.found_backward == 19
    places = [figures.middle(pose)[0] for _, pose in sorted(found.items()) if pose is not None]
    np.testing.assert_allclose(places, 40 + np.arange(20), atol=1)


def test_does_not_hop_to_a_passer_by_who_covers_the_person() -> None:
    # The person leaves the image while somebody else stands where the search looks first.
    clips = (
        [[(60, 60, 80, RED)]] * 10
        + [[(75, 60, 80, BLUE)]] * 20
        + [[(64, 60, 80, RED), (110, 60, 80, BLUE)]] * 5
    )
    made, places = follow(clips)
    assert places[10:30] == [None] * 20
    np.testing.assert_allclose(known(places[30:]), 64, atol=1)
    assert made.losses == 1


def test_a_jump_is_not_believed_but_found_again_with_time() -> None:
    clips = [[(30, 60, 80, RED)]] * 5 + [[(130, 60, 80, RED)]] * 25
    made, places = follow(clips)
    assert places[5] is None
    np.testing.assert_allclose(known(places[-1:]), 130, atol=1)
    assert made.losses == 1


def test_another_size_is_not_believed() -> None:
    _, places = follow([[(60, 60, 90, RED)]] * 5 + [[(60, 60, 30, RED)]] * 3)
    assert places[5:] == [None] * 3


def test_colours_that_change_for_good_lose_the_person_for_a_while_only() -> None:
    made = Tracker(files.Rectangles(), Choice())
    before, after = files.scene([(60, 60, 80, RED)]), files.scene([(60, 60, 80, RED)])
    after[44:, 45:75][after[44:, 45:75, 2] == RED[2]] = GREEN  # most of the trunk
    seen = [made.step(image, t / RATE) is not None for t, image in enumerate([before] * 5 + [after] * 150)]
    assert seen[:6] == [True] * 5 + [False]
    assert seen[-1]


@pytest.mark.parametrize(
    ("choice", "x"),
    [(Choice(), 100), (Choice(number=1), 100), (Choice(number=2), 30), (Choice(at_px=(28.0, 70.0)), 30)],
)
def test_choice_among_several(choice: Choice, x: float) -> None:
    made, places = follow([[(30, 60, 60, RED), (100, 60, 100, GREEN)]] * 3, choice)
    np.testing.assert_allclose(known(places), x, atol=1)
    assert len(made.first) == 2


def test_waits_for_the_person_asked_for() -> None:
    alone, both = [(100, 60, 100, GREEN)], [(30, 60, 60, RED), (100, 60, 100, GREEN)]
    for choice in (Choice(number=2), Choice(at_px=(30.0, 60.0))):
        _, places = follow([alone] * 4 + [both] * 2, choice)
        assert places[:4] == [None] * 4
        np.testing.assert_allclose(known(places[4:]), 30, atol=1)


def test_tiles_cover_the_longer_side() -> None:
    assert searching.tiles(100, 100) == []
    found = searching.tiles(1920, 1080)
    assert found[0][0] == 0
    assert found[-1][0] == 1920 - 1080
    assert all(b[0] <= a[0] + 1080 for a, b in itertools.pairwise(found))
    assert searching.tiles(1080, 1920)[-1][1] == 840


def test_colour_distance() -> None:
    a, b = np.array([1.0, 0.0]), np.array([0.0, 1.0])
    assert figures.colour_distance(a, a) == 0
    assert figures.colour_distance(a, b) == 1
    assert figures.colour_distance(a, None) == 0
