from __future__ import annotations

import numpy as np
import pytest

from simrecon.metrics import contact
from simrecon.types import Array

FPS = 30.0


def sliding(speed_mps: float, frames: int = 31) -> Array:
    """(T, 2, 3): the left foot slides along x, the right one rests."""
    feet = np.zeros((frames, 2, 3))
    feet[:, 0, 0] = speed_mps * np.arange(frames) / FPS
    return feet


def test_a_foot_that_slides_at_half_a_metre_a_second() -> None:
    """1.67 cm a frame at 30 fps, under the papers' 2 cm; at 15 fps over it: those depend on the rate."""
    feet, resting = sliding(0.5), np.ones((31, 2), dtype=bool)
    assert contact.skate_wham_mm(feet, np.zeros_like(feet)) == pytest.approx(0.5 * 500 / FPS)
    assert contact.footskate_pct(feet, np.zeros((31, 2))) == 0
    assert contact.skate_rempe_pct(feet, resting) == 0
    slow, slow_resting = feet[::2], resting[::2]
    assert contact.footskate_pct(slow, np.zeros((16, 2))) == pytest.approx(100)
    assert contact.footskate_annotated_pct(slow, slow_resting) == pytest.approx(100)
    assert contact.skate_rempe_pct(slow, slow_resting) == pytest.approx(50)
    for rate, points in ((FPS, sliding(0.51)), (FPS / 2, sliding(0.51)[::2])):
        found = contact.foot_metrics(points, np.zeros_like(points), 1 / rate)
        assert found["footskate_pct"] == pytest.approx(50)
        assert found["foot_slide_mps"] == pytest.approx(0.255)


def test_a_foot_that_rolls_over_its_toe_skates_at_the_ankle_alone() -> None:
    """The ankle moves 3 cm a frame about a toe that stays."""
    ankle, toe = np.zeros((2, 11, 1, 3))
    ankle[:, 0, 0] = 0.03 * np.arange(11)
    ankle[..., 2], lowest = 0.1, np.zeros((11, 1))
    assert contact.footskate_pct(ankle, lowest) == pytest.approx(100)
    heel, raised = ankle - np.array([0.05, 0.0, 0.05]), np.full((11, 1), 0.05)
    sole, height = np.concatenate((heel, toe), axis=1), np.concatenate((raised, lowest), axis=1)
    assert contact.footskate_pct(sole, height) == 0
    assert contact.footskate_pct(sole, np.zeros((11, 2))) == pytest.approx(100)


def test_a_mesh_touches_with_ten_vertices() -> None:
    height = np.full((3, 40), 0.3)
    height[0, 5:14], height[1, 5:15] = 0.004, 0.004
    np.testing.assert_allclose(contact.vertex_clearance(height), [0.3, 0.004, 0.3])
    assert contact.vertex_clearance(height[0], 9) == pytest.approx(0.004)


def test_a_body_floats_where_nothing_else_touches() -> None:
    """Hovering; a step beside a foot that stands; the feet of someone who sits; a jump; standing."""
    feet = np.array([[0.01, 0.015], [0.0, 0.01], [0.01, 0.01], [0.3, 0.3], [0.0, 0.0]])
    seat = np.array([[0.4], [0.9], [0.002], [1.0], [0.9]])
    floats = contact.float_body_frames(feet, np.concatenate((feet, seat), axis=1))
    np.testing.assert_array_equal(floats, [True, False, False, False, False])
    assert contact.float_pct(feet) == pytest.approx(60)


def test_wham_counts_only_where_the_reference_rests() -> None:
    truth = sliding(0.0)
    truth[16:, :, 0] = np.arange(15)[:, None]
    feet = sliding(3.0)
    assert contact.skate_wham_mm(feet, truth) == pytest.approx(50.0)
    assert np.isnan(contact.skate_wham_mm(feet, sliding(9.0) + sliding(9.0)[:, ::-1]))


def test_rempe_looks_three_centimetres_up_and_down() -> None:
    height = np.array([[0.0, 0.031], [-0.031, 0.5], [0.02, 0.02], [np.nan, 0.0]])
    contacts = np.array([[True, True], [True, False], [True, True], [True, False]])
    assert contact.floating_rempe_pct(height, contacts) == pytest.approx(100 / 6)
    assert contact.penetration_rempe_pct(height) == pytest.approx(100 / 7)
    assert np.isnan(contact.floating_rempe_pct(height, np.zeros((4, 2), dtype=bool)))


def test_annotated_float_has_no_upper_limit() -> None:
    clearance = np.array([[0.0, 0.5], [0.006, 0.0], [0.3, 0.0], [0.0, 0.0]])
    contacts = np.array([[True, False], [True, True], [True, True], [False, False]])
    assert contact.float_annotated_pct(clearance, contacts) == pytest.approx(50)
    assert contact.float_pct(clearance) == pytest.approx(25)


def test_a_body_ten_millimetres_under_the_floor() -> None:
    clearance = np.array([[0.5, -0.010], [0.5, -0.010], [0.4, -0.004], [0.4, 0.0]])
    mean, deepest = contact.penetration(clearance.min(-1))
    assert (mean, deepest) == pytest.approx((0.006, 0.010))
    assert contact.penetration_pct(clearance) == pytest.approx(50)
    assert contact.penetration_pct(clearance, 0.003) == pytest.approx(75)


def test_f1_of_each_part() -> None:
    truth = np.array([[1, 0, 0], [1, 0, 1], [1, 0, 1], [0, 0, 0]], dtype=bool)
    found = np.array([[1, 0, 0], [1, 0, 0], [0, 0, 0], [1, 0, 0]], dtype=bool)
    np.testing.assert_allclose(contact.contact_f1(found, truth), [2 / 3, np.nan, 0.0])
    np.testing.assert_allclose(contact.contact_f1(truth, truth), [1.0, np.nan, 1.0])


def test_contact_scores_do_not_change_under_a_turn_about_the_vertical(rng: np.random.Generator) -> None:
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    feet, truth = rng.normal(scale=0.02, size=(2, 40, 4, 3))
    resting = contact.reference_contacts(truth, 1.0)
    moved, moved_truth = feet @ turn.T + [3.0, -2.0, 0.0], truth @ turn.T + [3.0, -2.0, 0.0]
    np.testing.assert_array_equal(contact.reference_contacts(moved_truth, 1.0), resting)
    frames = contact.frame_contacts(resting)
    assert frames.shape == (40, 4)
    for score in (contact.skate_rempe_pct, contact.footskate_annotated_pct):
        assert score(moved, frames) == pytest.approx(score(feet, frames))
    assert contact.skate_wham_mm(moved, moved_truth, 0.03) == pytest.approx(
        contact.skate_wham_mm(feet, truth, 0.03)
    )
