"""Features of a motion: there and back, whatever way the person faces."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon.synthesis.features import CONTEXT, COUNT, POINTS, SCORED, features, places, stand
from tests.support.futures import joints, known


def test_the_papers_skeleton_has_fifteen_joints() -> None:
    assert len(SCORED) == 15
    assert POINTS[0] == "pelvis"
    assert COUNT == 57


def test_places_are_those_that_the_features_are_of(rng: np.random.Generator) -> None:
    motion = joints(known()) + np.cumsum(0.01 * rng.standard_normal((31, 1, 3)), axis=0)
    at = stand(motion[CONTEXT - 1], 1.9)
    values = features(motion, at)
    assert values.shape == (31, COUNT)
    np.testing.assert_allclose(places(values[CONTEXT:], at), motion[CONTEXT:], atol=1e-12)


@pytest.mark.parametrize("yaw", [0.0, 2.0, -3.0])
def test_features_do_not_change_with_direction_and_place(yaw: float, rng: np.random.Generator) -> None:
    motion = joints(known()) + np.cumsum(0.01 * rng.standard_normal((31, 1, 3)), axis=0)
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1.0]])
    other = motion @ turn.T + [3.0, -2.0, 0.5]
    one, two = (
        features(part, stand(part[CONTEXT - 1], 1.7, floor_m))
        for part, floor_m in ((motion, 0.0), (other, 0.5))
    )
    np.testing.assert_allclose(one, two, atol=1e-12)


def test_features_do_not_change_with_size() -> None:
    motion = joints(known())
    one = features(motion, stand(motion[CONTEXT - 1], 1.7))
    two = features(1.2 * motion, stand(1.2 * motion[CONTEXT - 1], 1.2 * 1.7))
    np.testing.assert_allclose(one, two, atol=1e-12)
