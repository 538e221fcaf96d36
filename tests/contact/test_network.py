"""What the contact network looks at, and what it says."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from simrecon import contact, resources
from simrecon.body import names
from simrecon.contact import Cues, features, network, parts
from simrecon.errors import InputError
from simrecon.types import Array
from tests.support import people

COUNT = len(features.POINTS)


def walk(fps: float, seconds: float = 2.0) -> Array:
    """Points (T, N, 3) of a person who walks."""
    at = people.walking(round(seconds * fps) + 1, speed_mps=1.2, fps=fps)
    return np.stack([at[name] for name in features.POINTS], axis=1)


def seen(points: Array, fps: float, rows: Array | None = None, shift: float = 0.0) -> Array:
    """Inputs of points that a camera sees from the side."""
    image = points[..., [0, 2]] * [1.0, -1.0] + shift
    ones = np.ones(points.shape[:2])
    chosen = None if rows is None else rows.astype(np.int64)
    return features.features(image, ones, points + shift, ones, 1 / fps, chosen)


def test_inputs_are_the_same_at_any_frame_rate() -> None:
    slow, fast = seen(walk(30.0), 30.0), seen(walk(60.0), 60.0)
    assert slow.shape == (61, features.COUNT)
    np.testing.assert_allclose(slow, fast[::2], atol=0.05)
    assert np.abs(slow).mean() > 0.05


def test_inputs_do_not_depend_on_where_the_person_is() -> None:
    np.testing.assert_allclose(seen(walk(30.0), 30.0), seen(walk(30.0), 30.0, shift=3.0), atol=1e-5)


def test_inputs_of_some_frames_are_those_of_all() -> None:
    rows = np.array([3, 40])
    np.testing.assert_allclose(seen(walk(30.0), 30.0)[rows], seen(walk(30.0), 30.0, rows), atol=1e-6)


def test_what_is_missing_is_zero() -> None:
    points = walk(30.0)
    scores, none = np.ones(points.shape[:2]), np.zeros(points.shape[:2])
    toe = features.POINTS.index("left_toe")
    scores[:, toe] = 0.05
    image = points[..., [0, 2]].copy()
    image[:, toe] = np.nan
    made = features.features(image, scores, np.full_like(points, np.nan), none, 1 / 30)
    each = made.reshape(61, len(features.OFFSETS_S), COUNT, features.CHANNELS)
    assert np.isfinite(made).all()
    assert not each[:, :, toe].any()
    assert not each[..., 3:].any()


def cues(points: Array, fps: float, *, in_world: bool = True) -> Cues:
    """A 3D estimate without an image."""
    rows = names.resolve(features.POINTS)
    total = len(names.points())
    joints, known = np.zeros((total, len(points), 3)), np.zeros((total, len(points)))
    joints[rows], known[rows] = np.swapaxes(points, 0, 1), 1.0
    blank = np.zeros((total, len(points), 2))
    return Cues(1 / fps, None, blank, blank[..., 0], joints, known, in_world)


def test_the_shipped_network_says_how_surely_each_part_touches() -> None:
    path = resources.folder("models") / "contact" / "network.npz"
    assert path.stat().st_size <= 300 * 1024
    assert set(network.shipped().parts) == set(parts.names())
    found = contact.label(cues(walk(30.0), 30.0), "network")
    assert found.source == "network"
    for part in network.shipped().parts:
        assert 0.0 <= found.of(part).min() <= found.of(part).max() <= 1.0
    for part in ("left_buttock", "right_hand", "left_knee", "back"):
        assert found.of(part).max() < 0.5  # who walks does not sit, though the rule takes still hips for it


def test_what_is_still_stands_more_surely_than_the_network_alone_says(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Log-odds of network and rule are added up; without a word of the rule the network's stay."""
    own = network.shipped().parts
    layer = (np.zeros((len(own), features.COUNT), np.float32), np.zeros(len(own), np.float32))
    monkeypatch.setattr(network, "shipped", lambda: network.Network((layer,), own))
    still = cues(np.repeat(walk(30.0)[:1], 61, axis=0), 30.0)
    found, rules = contact.label(still, "network"), contact.label(still)
    odds = np.clip(rules.of("left_heel"), 1 - network.SUREST, network.SUREST)
    expected = 1 / (1 + (1 / odds - 1) ** network.YES)
    assert (rules.of("left_heel") > 0.5).all()
    np.testing.assert_allclose(found.of("left_heel"), expected)
    np.testing.assert_allclose(found.of("left_hand"), 0.5)


def test_a_person_who_stands_stands_and_one_who_runs_by_mostly_does_not() -> None:
    still = np.repeat(walk(30.0)[:1], 61, axis=0)
    assert contact.label(cues(still, 30.0), "network").of("left_toe").min() > 0.5
    flying = walk(30.0) + np.linspace(0, 12, 61)[:, None, None] * [1.0, 0.0, 0.0]
    assert contact.label(cues(flying, 30.0), "network").of("left_toe").mean() < 0.5


def test_an_estimate_away_from_its_place_counts_for_nothing() -> None:
    placed, loose = (contact.label(cues(walk(30.0), 30.0, in_world=w), "network") for w in (True, False))
    assert not np.array_equal(placed.of("left_toe"), loose.of("left_toe"))


def test_a_frame_costs_less_than_a_millisecond() -> None:
    given = cues(walk(30.0, 10.0), 30.0)
    network.shipped()
    began = time.process_time()
    contact.label(given, "network")
    assert (time.process_time() - began) / 301 < 1e-3


def test_a_file_that_is_no_network_is_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", schema="simrecon.flow/1")
    with pytest.raises(InputError, match="schema"):
        network.read(tmp_path / "a.npz")
