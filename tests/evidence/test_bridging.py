from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon.evidence.video import bridging, figures
from simrecon.evidence.video.blazepose import Pose, Region
from simrecon.evidence.video.bridging import Seen
from simrecon.evidence.video.passes import Passes
from simrecon.evidence.video.tracker import Choice, Tracker
from simrecon.types import Array
from tests.support import video_files as files
from tests.support.video_files import BLUE, RED, Person

RATE = 30


def person(x: float, y: float = 60.0, height: float = 80.0) -> Pose:
    image = files.scene([(x, y, height, RED)], (320, 240))
    return files.Rectangles().pose(image, Region(np.array([x, y]), 1.3 * height, 0.0))


def walk(speed: float, count: int = 6, rise: float = 0.0) -> list[Seen]:
    """Somebody who moves by so many pixels a frame, until time 0."""
    return [Seen(t / RATE, person(100.0 + speed * t, 120.0 - rise * t)) for t in range(1 - count, 1)]


def test_who_goes_on_as_before_is_connected() -> None:
    assert bridging.connects(walk(2.0), Seen(10 / RATE, person(120.0, 120.0)))
    assert bridging.connects(walk(2.0)[-1:], Seen(10 / RATE, person(100.0, 120.0)))  # of unknown speed
    assert not bridging.connects([], Seen(0.0, person(100.0)))


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (walk(2.0), Seen(20 / RATE, person(140.0, 120.0))),  # too long
        (walk(4.0), Seen(10 / RATE, person(100.0, 120.0))),  # turned back
        (walk(0.0, rise=4.0), Seen(10 / RATE, person(100.0, 120.0))),  # a jump comes down again
        (walk(0.0), Seen(10 / RATE, person(100.0, 120.0, 110.0))),  # somebody larger
    ],
)
def test_who_does_something_else_is_not(before: list[Seen], after: Seen) -> None:
    assert not bridging.connects(before, after)


def turned(pose: Pose, angle_rad: float) -> Pose:
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    points: Array = (pose.points_px - figures.middle(pose)) @ np.array([[cos, sin], [-sin, cos]])
    return replace(
        pose,
        points_px=points + figures.middle(pose),
        region=replace(pose.region, angle_rad=pose.region.angle_rad + angle_rad),
    )


def test_who_has_turned_over_is_not_connected() -> None:
    assert not bridging.connects(walk(0.0), Seen(5 / RATE, turned(person(100.0, 120.0), 0.7)))


def test_nothing_is_known_of_who_is_hidden_but_the_way() -> None:
    before, after = Seen(0.0, person(100.0)), Seen(0.2, turned(person(120.0), 0.2))
    pose = bridging.expected(before, after, 0.05)
    np.testing.assert_allclose(pose.region.centre_px, [105.0, 60.0])
    assert pose.region.angle_rad == pytest.approx(0.05)
    np.testing.assert_allclose(pose.points_px, 0.75 * before.pose.points_px + 0.25 * after.pose.points_px)
    assert not pose.scores.any()
    assert np.isnan(pose.world_m).all()


def test_landmarks_that_are_seen_where_they_are_expected_count() -> None:
    pose, found = bridging.expected(Seen(0.0, person(100.0)), Seen(0.2, person(100.0)), 0.1), person(101.0)
    far = np.arange(33) % 2 == 0
    some = replace(found, points_px=found.points_px + np.where(far[:, None], 30.0, 0.0))
    result = bridging.with_seen(pose, some)
    np.testing.assert_array_equal(result.scores > 0, ~far)
    np.testing.assert_array_equal(result.points_px[~far], some.points_px[~far])
    np.testing.assert_array_equal(result.points_px[far], pose.points_px[far])
    elsewhere = replace(found, points_px=found.points_px + np.where(np.arange(33)[:, None] < 26, 30.0, 0.0))
    assert not bridging.with_seen(pose, elsewhere).scores.any()  # too few: somebody else


def passing(t: int) -> list[Person]:
    """A red person, whom a blue one covers in frames 10 to 14."""
    return [(40.0 + t, 60, 80, BLUE)] if 10 <= t < 15 else [(40.0 + t, 60, 80, RED)]


@pytest.mark.parametrize("anchored", [True, False])
def test_a_person_who_is_covered_for_a_moment_is_bridged(anchored: bool) -> None:
    passes, found = Passes(Tracker(files.Rectangles(), Choice())), dict[int, Pose | None]()
    for t in range(24):
        image = files.scene(passing(t))
        anchor = files.Rectangles().pose(image, Region(np.array([40.0 + t, 60.0]), 104.0, 0.0))
        found |= passes.step(t, image, t / RATE, anchor if anchored and t == 20 else None)
    found |= passes.finish()
    poses = [pose for _, pose in sorted(found.items()) if pose is not None]
    assert len(poses) == 24
    np.testing.assert_allclose([figures.middle(pose)[0] for pose in poses], 40 + np.arange(24), atol=1)
    hidden = [t for t, pose in sorted(found.items()) if pose is not None and np.isnan(pose.world_m).all()]
    assert hidden == [10, 11, 12, 13, 14]
    assert not any(poses[t].scores.any() for t in hidden)  # the blue one has other colours


def test_who_is_gone_for_long_is_unseen() -> None:
    passes, found = Passes(Tracker(files.Rectangles(), Choice())), dict[int, Pose | None]()
    for t in range(50):
        people: list[Person] = [] if 10 <= t < 30 else [(40.0, 60, 80, RED)]
        found |= passes.step(t, files.scene(people), t / RATE)
    found |= passes.finish()
    assert [t for t in found if found[t] is None] == list(range(10, 30))
