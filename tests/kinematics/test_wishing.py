"""A kinematic fit with contacts as a user wishes them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from simrecon import kinematics
from simrecon.contact import rules
from simrecon.contact.parts import names
from simrecon.kinematics.touched import touched
from simrecon.plan import Kinematics
from simrecon.types import ContactWish, Evidence, Ground, Scene, SceneItem

FRAMES, FLOOR = 31, Scene()


@pytest.fixture(scope="module")
def evidence(make: Any) -> Evidence:
    walk = make.walking(FRAMES)
    camera = make.looking_at(np.array([4.0, -3.0, 1.5]), np.array([0.5, 0.2, 1.0]))
    seen: Evidence = make.seen(walk, camera, noise_px=1.0, noise_m=0.01)
    return seen


def parts_of(evidence: Evidence, weights: Kinematics, *asked: ContactWish, scene: Scene = FLOOR) -> Any:
    fit = kinematics.fit(evidence, scene, weights, None, asked)
    return fit, touched(fit.body, fit.scene, fit.qpos, fit.times_s)


def test_a_foot_is_kept_still_and_the_rest_hardly_moves(evidence: Evidence, weights: Kinematics) -> None:
    plain, before = parts_of(evidence, weights)
    heel = names().index("left_heel")
    wish = ContactWish("left_heel", "auto", ((0.3, 0.5),))
    frames = (evidence.times_s >= 0.3) & (evidence.times_s <= 0.5)
    fit, after = parts_of(evidence, weights, wish)
    assert rules.near(after.clearance_m[frames, heel]).all()
    assert after.speed_mps[frames, heel][1:].max() < rules.SLOW_MPS
    assert before.speed_mps[frames, heel].max() > rules.SLOW_MPS
    moved = np.linalg.norm(fit.qpos[:, :3] - plain.qpos[:, :3], axis=1)
    assert moved.mean() < 0.05
    assert fit.contacts is not None
    np.testing.assert_array_equal(fit.contacts.of("left_heel")[frames], 1.0)
    assert plain.wished is None


def test_a_heel_is_raised_over_floor_and_items(evidence: Evidence, weights: Kinematics) -> None:
    block = SceneItem("block", "box", (0.0, 0.0, -0.2), {"size_m": (6.0, 6.0, 0.2)})
    for scene in (Scene(), Scene(Ground(-0.2), (block,))):
        _, after = parts_of(evidence, weights, ContactWish("right_heel", "never"), scene=scene)
        assert not rules.near(after.clearance_m[:, names().index("right_heel")]).any()


def test_what_is_far_from_everything_is_left_alone(evidence: Evidence, weights: Kinematics) -> None:
    plain, _ = parts_of(evidence, weights)
    fit, after = parts_of(evidence, weights, ContactWish("left_hand", "always"))
    np.testing.assert_array_equal(fit.qpos, plain.qpos)
    assert after.clearance_m[:, names().index("left_hand")].min() > 0.3
    assert fit.wished is not None  # it was asked for all the same


def test_a_fit_says_how_surely_its_parts_touch(evidence: Evidence, weights: Kinematics) -> None:
    fit, found = parts_of(evidence, weights)
    assert fit.contacts is not None
    assert fit.contacts.probability.shape == (FRAMES, len(names()))
    assert np.nanmax(fit.contacts.of("back")) < 1e-6
    soles = [names().index(f"{side}_{end}") for side in ("left", "right") for end in ("heel", "toe")]
    assert found.clearance_m[:, soles].min(axis=1).max() < 0.03
    assert fit.contacts.probability[:, soles].max() > 0.3
