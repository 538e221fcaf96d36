"""How far a fit may be off, by its own curvature."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon import kinematics
from simrecon import plan as plans
from simrecon.kinematics.spread import sight
from simrecon.types import Array, Evidence, Scene
from tests.support.runs import camera, person, seen, squat

FRAMES = 6


def clip() -> Evidence:
    body = person()
    return seen(body, squat(body, np.linspace(0.0, 0.2, FRAMES)))


def spread(evidence: Evidence) -> Array:
    plan = replace(plans.read("quick").kinematics, evaluations=60)
    found = kinematics.fit(evidence, Scene(), plan).spread_m
    assert found is not None
    return found


def test_depth_is_known_the_least() -> None:
    across, along = spread(clip())
    assert across.shape == (FRAMES, 36, 3)
    assert np.isfinite(across).all()
    assert np.linalg.norm(along, axis=-1).mean() > np.linalg.norm(across, axis=-1).mean() / np.sqrt(2)
    assert (np.linalg.norm(along, axis=-1) > 0).all()


def test_who_sees_less_knows_less() -> None:
    whole = clip()
    poor = replace(whole, scores=0.03 * whole.scores)
    assert spread(poor)[0].mean() > 1.1 * spread(whole)[0].mean()


def test_the_same_clip_has_the_same_spread() -> None:
    np.testing.assert_array_equal(spread(clip()), spread(clip()))


def test_the_line_of_sight_leads_from_the_camera_to_the_person() -> None:
    points = np.tile([0.0, 0.0, 1.0], (FRAMES, 2, 1))
    np.testing.assert_allclose(sight(points, camera(FRAMES))[0, 0], [-1.0, 0.0, 0.0], atol=1e-12)
    assert not sight(points, None).any()
