"""What touches and what rests by speed, height and force."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon.contact import rules

STEP_S = 1 / 30


@pytest.mark.parametrize("rate_hz", [24.0, 30.0, 60.0])
def test_a_point_is_as_still_at_any_frame_rate(rate_hz: float) -> None:
    times = np.arange(0, 2, 1 / rate_hz)
    walk = np.outer(times, [0.4, 0.0])[None]
    surely = rules.still(walk, np.ones((1, len(times))), 1 / rate_hz)
    assert surely[len(times) // 2] == pytest.approx(np.exp(-1.0), abs=1e-6)


def test_points_that_are_not_known_do_not_move() -> None:
    places = np.zeros((1, 30, 2))
    places[0, 10] = 5.0
    known = np.ones((1, 30))
    known[0, 10] = 0.0
    assert rules.still(places, known, STEP_S).min() > 0.99
    assert rules.still(places, np.ones((1, 30)), STEP_S).min() < 0.01


def test_touching_fades_faster_above_a_support_than_below() -> None:
    above, below = rules.touching(np.array([0.02, -0.05]))
    assert above == pytest.approx(below)
    assert rules.touching(np.zeros(1)) == 1.0


def test_a_point_is_held_by_what_it_touches_at_both_ends_of_a_step() -> None:
    surely = np.array([[1.0, 1.0, 0.0]])
    np.testing.assert_allclose(rules.held(np.zeros((1, 2)), surely), [[1.0, 0.0]])
    assert rules.held(np.full((1, 2), 1.0), surely).max() < 1e-9


def test_reference_contacts_are_low_and_slow() -> None:
    height = np.concatenate((np.zeros(20), [0.1, 0.1, 0.02]))[:, None]
    speed = np.zeros((22, 1))
    speed[5] = 0.2
    resting = rules.reference_contacts(height, speed)[:, 0]
    assert not resting[5]
    assert resting[[0, 18, 21]].all()
    assert not resting[[19, 20]].any()


def test_limits_are_where_they_are_said_to_be() -> None:
    assert rules.loaded(np.array([19.9, 20.1])).tolist() == [False, True]
    assert rules.pushed(np.array([3.9, 4.1])).tolist() == [False, True]
    assert rules.near(np.array([0.019, 0.021])).tolist() == [True, False]
    assert rules.touches(np.array([0.029, 0.031])).tolist() == [True, False]
    assert rules.on_support(np.array([0.005, 0.006])).tolist() == [True, False]
    assert rules.flies(np.array([[0.06, 0.06], [0.06, 0.04]])).tolist() == [True, False]
    assert rules.stands(np.array([0.2, 0.2, 0.3]), np.array([0.05, 0.1, 0.05])).tolist() == [
        True,
        False,
        False,
    ]
    assert rules.seated(np.array([0.1, 0.4, 0.8]), np.zeros(3), 1.7).tolist() == [False, True, False]
    assert rules.sits(np.array([0.54, 0.56]), 0.5, np.zeros(2)).tolist() == [True, False]
    assert rules.stands_by(np.array([0.02, 0.04]), np.zeros(2), np.full(2, 0.5)).tolist() == [True, False]
