"""Spheres that stand for the body, and what is held to a support."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon.contact import labels
from simrecon.kinematics.contacts import contact_points, pulls
from simrecon.kinematics.problem import Problem


def test_contact_points_are_those_of_the_primitives(problem: Problem) -> None:
    touch = problem.contacts
    assert touch.mass_share.sum() == pytest.approx(1.0)
    assert len(touch.segments) == 22 * 2 + 4 * 8
    for side, rows in zip(("left", "right"), touch.soles, strict=True):
        ankle = problem.skeleton.names.index(f"{side}_ankle")
        assert (touch.segments[rows] == ankle).all()
        feet = touch.segments == ankle
        corners = touch.offsets_m[feet & (touch.radii_m == 0)]
        np.testing.assert_allclose(touch.offsets_m[rows, 2], corners[:, 2].min())
        assert len({tuple(place) for place in touch.offsets_m[rows]}) == 4
        np.testing.assert_array_equal(touch.drop[rows], np.tile([0.0, 0.0, -1.0], (4, 1)))


def test_soles_that_roll_bear_at_a_round_heel_and_a_round_ball(problem: Problem) -> None:
    person = bodies.build(problem.skeleton, height_m=1.75, mass_kg=70.0)
    edges = contact_points(person.skeleton, person.primitives)
    touch = contact_points(person.skeleton, person.primitives, rolling=True)
    np.testing.assert_array_equal(touch.parts[0], edges.parts[0])
    for rows in touch.soles:
        heel, tip = edges.offsets_m[rows[[0, 2]], 0]
        at = (touch.offsets_m[rows, 0] - heel) / (tip - heel)
        np.testing.assert_allclose(at, [0.165, 0.165, 0.847, 0.847])
        np.testing.assert_allclose(touch.radii_m[rows] / (tip - heel), [0.124, 0.124, 0.062, 0.062])
        lowest = touch.offsets_m[rows, 2] - touch.radii_m[rows]
        np.testing.assert_allclose(lowest, edges.offsets_m[rows, 2])
    others = np.setdiff1d(np.arange(len(touch.segments)), touch.soles)
    np.testing.assert_array_equal(touch.offsets_m[others], edges.offsets_m[others])


def test_both_buttocks_of_hips_at_rest_are_held_to_a_seat(problem: Problem) -> None:
    touch, frames = problem.contacts, problem.frames
    for side, rows in zip(("left", "right"), touch.seat, strict=True):
        assert (touch.segments[rows] == problem.skeleton.names.index("pelvis")).all()
        assert ((touch.offsets_m[rows, 1] > 0) == (side == "left")).all()
    clearance = np.full((2, len(touch.segments), frames), 0.5)
    clearance[1, touch.seat[:, 1]] = 0.03  # over the second support, an item
    sitting = np.array([1.0, 0.5, 0.0, 0.0])
    known = labels.of_feet_and_hips(problem.observations.standing, sitting, "test")
    for pull, rows in zip(pulls(touch, known, clearance)[-2:], touch.seat, strict=True):
        support, point, frame = pull.at
        assert (support == 1).all()
        assert (point == rows[1]).all()
        np.testing.assert_array_equal(frame, np.arange(frames))
        np.testing.assert_array_equal(pull.weights, sitting)
    # over the ground alone they are not
    assert len(pulls(touch, known, clearance[:1])) == 3


def test_corners_of_soles_are_held_level_on_the_ground_and_loosely_on_items(problem: Problem) -> None:
    touch, frames = problem.contacts, problem.frames
    clearance = np.full((2, len(touch.segments), frames), 0.02)
    clearance[1, touch.soles[0, :2]] = 0.01  # the left heel is nearer to an item
    known = labels.of_feet_and_hips(np.full((2, frames), 0.5), np.zeros(frames), "test")
    ground, items = pulls(touch, known, clearance)[1:3]
    on_item = np.array([True, True, *[False] * 6])[:, None]
    np.testing.assert_allclose(ground.weights, np.where(on_item, 0.0, 0.6 * 0.125) + np.zeros((8, frames)))
    np.testing.assert_allclose(items.weights, np.where(on_item, 0.125, 0.0) + np.zeros((8, frames)))
    assert ground.sigma < items.sigma
