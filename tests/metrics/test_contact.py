from __future__ import annotations

import numpy as np

from simrecon.metrics import contact


def test_reference_contacts_are_low_and_slow() -> None:
    points = np.zeros((30, 1, 3))
    points[10:20, 0, 2] = 0.2  # lifted
    points[20:, 0, 0] = 0.1 * np.arange(10)  # slides at 1 m/s
    contacts = contact.reference_contacts(points, 0.1)
    np.testing.assert_array_equal(np.flatnonzero(contacts), np.arange(9))


def test_contacts_by_frame_do_not_change_under_a_turn_about_the_vertical(rng: np.random.Generator) -> None:
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    truth = rng.normal(scale=0.02, size=(40, 4, 3))
    resting = contact.reference_contacts(truth, 1.0)
    assert resting.any()
    np.testing.assert_array_equal(contact.reference_contacts(truth @ turn.T + [3.0, -2.0, 0.0], 1.0), resting)
    frames = contact.frame_contacts(resting)
    np.testing.assert_array_equal(frames[1:], resting)
    np.testing.assert_array_equal(frames[0], resting[0])


def test_f1_of_each_part() -> None:
    truth = np.array([[1, 0, 0], [1, 0, 1], [1, 0, 1], [0, 0, 0]], dtype=bool)
    contacts = np.array([[1, 0, 0], [1, 0, 0], [0, 0, 0], [1, 0, 0]], dtype=bool)
    np.testing.assert_allclose(contact.contact_f1(contacts, truth), [2 / 3, np.nan, 0.0])
    np.testing.assert_allclose(contact.contact_f1(truth, truth), [1.0, np.nan, 1.0])
