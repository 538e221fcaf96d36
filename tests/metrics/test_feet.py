from __future__ import annotations

import numpy as np
import pytest

from simrecon.metrics import contact, feet
from simrecon.metrics.statistics import of_frames
from simrecon.types import Array, Flags

FPS = 30.0


def pct(flags: Array | Flags) -> float:
    """Per cent of what counts."""
    return of_frames(flags, scale=100.0).value


def sliding(speed_mps: float, frames: int = 31) -> Array:
    """(T, 2, 3): the left foot slides along x, the right one rests."""
    points = np.zeros((frames, 2, 3))
    points[:, 0, 0] = speed_mps * np.arange(frames) / FPS
    return points


def steps(lengths_m: list[float]) -> Array:
    """(T, 2, 3): the left foot moves along x by each length, the right one rests."""
    points = np.zeros((len(lengths_m) + 1, 2, 3))
    points[1:, 0, 0] = np.cumsum(lengths_m)
    return points


def test_a_foot_that_slides_at_half_a_metre_a_second() -> None:
    """1.67 cm a frame at 30 fps, under the papers' 2 cm; at 15 fps over it: those depend on the rate."""
    points, resting = sliding(0.5), np.ones((31, 2), dtype=bool)
    slides_m = of_frames(feet.resting_steps(points, np.zeros_like(points))).value
    assert slides_m == pytest.approx(0.25 / FPS)
    assert pct(feet.footskate_steps(points, np.zeros((31, 2)))) == 0
    assert pct(feet.skating_points(points, resting)) == 0
    slow, slow_resting = points[::2], resting[::2]
    assert pct(feet.footskate_steps(slow, np.zeros((16, 2)))) == pytest.approx(100)
    assert pct(feet.footskate_annotated_steps(slow, slow_resting)) == pytest.approx(100)
    assert pct(feet.skating_points(slow, slow_resting)) == pytest.approx(50)
    for rate, moving in ((FPS, sliding(0.51)), (FPS / 2, sliding(0.51)[::2])):
        assert pct(feet.fast_steps(moving, 1 / rate)) == pytest.approx(50)


def test_footskate_needs_contact_and_two_centimetres() -> None:
    points = steps([0.0, 0.03, 0.01, 0.03])
    clearance = np.zeros((5, 2))
    np.testing.assert_array_equal(feet.footskate_steps(points, clearance), [False, True, False, True])
    clearance[4, 0] = 0.006  # lifts during the last step
    np.testing.assert_array_equal(feet.footskate_steps(points, clearance), [False, True, False, False])


def test_a_foot_that_rolls_over_its_toe_skates_at_the_ankle_alone() -> None:
    """The ankle moves 3 cm a frame about a toe that stays."""
    ankle, toe = np.zeros((2, 11, 1, 3))
    ankle[:, 0, 0] = 0.03 * np.arange(11)
    ankle[..., 2], lowest = 0.1, np.zeros((11, 1))
    assert feet.footskate_steps(ankle, lowest).all()
    heel, raised = ankle - np.array([0.05, 0.0, 0.05]), np.full((11, 1), 0.05)
    sole, height = np.concatenate((heel, toe), axis=1), np.concatenate((raised, lowest), axis=1)
    assert not feet.footskate_steps(sole, height).any()
    assert feet.footskate_steps(sole, np.zeros((11, 2))).all()


def test_float_counts_feet_just_above_the_ground() -> None:
    clearance = np.array([[0.0, 0.5], [0.01, 0.0], [0.03, 0.03], [0.0051, 0.5]])
    np.testing.assert_array_equal(feet.float_frames(clearance), [False, True, False, True])


def test_a_body_floats_where_nothing_else_touches() -> None:
    """Hovering; a step beside a foot that stands; the feet of someone who sits; a jump; standing."""
    low = np.array([[0.01, 0.015], [0.0, 0.01], [0.01, 0.01], [0.3, 0.3], [0.0, 0.0]])
    seat = np.array([[0.4], [0.9], [0.002], [1.0], [0.9]])
    floats = feet.float_body_frames(low, np.concatenate((low, seat), axis=1))
    np.testing.assert_array_equal(floats, [True, False, False, False, False])
    assert pct(feet.float_frames(low)) == pytest.approx(60)


def test_wham_counts_only_where_the_reference_rests() -> None:
    truth = sliding(0.0)
    truth[16:, :, 0] = np.arange(15)[:, None]
    moving = sliding(3.0)
    assert 1e3 * of_frames(feet.resting_steps(moving, truth)).value == pytest.approx(50.0)
    assert np.isnan(feet.resting_steps(moving, sliding(9.0) + sliding(9.0)[:, ::-1])).all()


def test_rempe_looks_three_centimetres_up_and_down() -> None:
    height = np.array([[0.0, 0.031], [-0.031, 0.5], [0.02, 0.02], [np.nan, 0.0]])
    contacts = np.array([[True, True], [True, False], [True, True], [True, False]])
    floats = np.array([[0, 1], [0, np.nan], [0, 0], [np.nan, np.nan]])
    np.testing.assert_array_equal(feet.floating_points(height, contacts), floats)
    sinks = np.array([[0, 0], [1, 0], [0, 0], [np.nan, 0]])
    np.testing.assert_array_equal(feet.penetrating_points(height), sinks)
    assert pct(feet.penetrating_points(height)) == pytest.approx(100 / 7)
    assert np.isnan(pct(feet.floating_points(height, np.zeros((4, 2), dtype=bool))))


def test_annotated_float_has_no_upper_limit() -> None:
    clearance = np.array([[0.0, 0.5], [0.006, 0.0], [0.3, 0.0], [0.0, np.nan]])
    contacts = np.array([[True, False], [True, True], [True, True], [False, False]])
    np.testing.assert_array_equal(feet.float_annotated_frames(clearance, contacts), [0, 1, 1, np.nan])
    np.testing.assert_array_equal(feet.float_frames(clearance), [False, True, False, False])


def test_scores_do_not_change_under_a_turn_about_the_vertical(rng: np.random.Generator) -> None:
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    points, truth = rng.normal(scale=0.02, size=(2, 40, 4, 3))
    resting = contact.frame_contacts(contact.reference_contacts(truth, 1.0))
    moved, moved_truth = points @ turn.T + [3.0, -2.0, 0.0], truth @ turn.T + [3.0, -2.0, 0.0]
    for flags in (feet.skating_points, feet.footskate_annotated_steps):
        assert pct(flags(points, resting)) > 0
        np.testing.assert_array_equal(flags(moved, resting), flags(points, resting))
    np.testing.assert_allclose(
        feet.resting_steps(moved, moved_truth), feet.resting_steps(points, truth), atol=1e-12
    )
    assert np.isfinite(feet.resting_steps(points, truth)).any()
