from __future__ import annotations

import numpy as np
import pytest

from simrecon.evidence.video import swaps
from simrecon.evidence.video.blazepose import NAMES
from simrecon.types import Array, IntArray

T = 60
ARMS, LEGS = (swaps.pairs(parts) for parts in (swaps.ARMS, swaps.LEGS))
Walk = tuple[Array, Array, Array, Array, Array]
"""Times, points, scores, world and scale, as `swaps.find` takes them."""


@pytest.fixture
def walk() -> Walk:
    """A person who walks to the right, seen from the side: limbs cross twice a second."""
    times = np.arange(T) / 30
    world = np.zeros((T, 33, 3))
    for i, name in enumerate(NAMES):
        side = {"left": -1, "righ": 1}.get(name[:4], 0)
        swing = 0.3 if name.split("_")[-1] in ("ankle", "heel", "index", "wrist", "knee") else 0.02
        world[:, i, 0] = side * swing * np.sin(2 * np.pi * times)
        world[:, i, 1] = i / 33
        world[:, i, 2] = 0.15 * side
    points = 200 * world[..., :2] + np.stack((300 + 150 * times, np.full(T, 400)), axis=-1)[:, None]
    return times, points, np.full((T, 33), 0.9), world, np.full(T, 200.0)


def swap(values: Array, rows: list[int], index: IntArray) -> Array:
    made = values.copy()
    at = np.array(rows)
    made[np.ix_(at, index.ravel())] = values[np.ix_(at, index[:, ::-1].ravel())]
    return made


def test_crossing_limbs_are_left_alone(walk: Walk) -> None:
    assert not swaps.find(*walk).any()


@pytest.mark.parametrize("rows", [[7], [0], [59], list(range(20, 32)), [5, 6, 30, 31, 32, 50]])
def test_swapped_frames_are_found_and_undone(walk: Walk, rows: list[int]) -> None:
    times, points, scores, world, scale = walk
    mixed, mixed_world = swap(points, rows, LEGS), swap(world, rows, LEGS)
    found = swaps.find(times, mixed, scores, mixed_world, scale)
    assert np.flatnonzero(found[:, 1]).tolist() == rows
    assert not found[:, 0].any()
    np.testing.assert_array_equal(swaps.exchange(mixed, found), points)
    np.testing.assert_array_equal(swaps.exchange(mixed_world, found), world)


def test_arms_and_legs_are_told_apart(walk: Walk) -> None:
    times, points, scores, world, scale = walk
    points, world = swap(points, [10, 11], ARMS), swap(world, [10, 11], ARMS)
    points, world = swap(points, [40], LEGS), swap(world, [40], LEGS)
    found = swaps.find(times, points, scores, world, scale)
    assert np.argwhere(found).tolist() == [[10, 0], [11, 0], [40, 1]]


def test_long_videos_go_by_parts(walk: Walk, monkeypatch: pytest.MonkeyPatch) -> None:
    times, points, scores, world, scale = walk
    points, world = swap(points, [20, 21, 40], LEGS), swap(world, [20, 21, 40], LEGS)
    whole = swaps.find(times, points, scores, world, scale)
    monkeypatch.setattr(swaps, "_CHUNK", 7)
    np.testing.assert_array_equal(swaps.find(times, points, scores, world, scale), whole)
    assert whole.sum() == 3


def test_unseen_frames_and_gaps(walk: Walk) -> None:
    times, points, scores, world, scale = walk
    points = swap(points, [20], LEGS)
    world = swap(world, [20], LEGS)
    points[21:23], world[21:23], scale = np.nan, np.nan, scale.copy()
    scale[21:23] = np.nan
    found = swaps.find(times, points, scores, world, scale)
    assert np.argwhere(found).tolist() == [[20, 1]]
    assert not swaps.find(times, np.full_like(points, np.nan), scores, world, scale).any()
