"""How tall a person is taken to be: as somebody says, as a metric source measures, else as adults are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import kinematics, trust
from simrecon.kinematics import stature_prior
from simrecon.plan import Kinematics
from simrecon.types import Camera, Scene
from tests.kinematics.conftest import Makers

CHILD = bodies.measure_template(bodies.scaled({}, 1.30))
LENGTHS = bodies.measure_template(bodies.scaled({}, 1.45))


def test_adults_are_a_prior_that_the_source_moves_as_far_as_it_is_worth() -> None:
    world = stature_prior.settle(None, LENGTHS, trust.parse("world", "test"), floor="scene")
    camera = stature_prior.settle(None, LENGTHS, trust.parse("camera", "test"), floor="scene")
    nothing = stature_prior.settle(None, {}, trust.parse("landmarks", "test"), floor="scene")
    assert nothing.height_m == pytest.approx(1.70)
    assert nothing.sigma == pytest.approx(0.10 / 1.70)
    shown = world.shown_m
    assert shown is not None
    assert shown == camera.shown_m
    assert world.height_m is not None
    assert camera.height_m is not None
    assert shown < world.height_m < camera.height_m < 1.70
    share = (np.log(world.height_m) - np.log(1.70)) / (np.log(shown) - np.log(1.70))
    assert share == pytest.approx(0.05**-2 / (0.05**-2 + nothing.sigma**-2))
    assert world.sigma < nothing.sigma
    assert {world.origin, camera.origin, nothing.origin} == {"assumed"}


def test_without_a_known_floor_the_prior_is_held_tighter() -> None:
    worth = trust.parse("camera", "test")
    known, blind = (stature_prior.settle(None, LENGTHS, worth, floor=floor) for floor in ("scene", "unknown"))
    assert blind.height_m == known.height_m
    assert blind.sigma < 0.5 * known.sigma


def test_what_is_said_holds_and_motion_capture_outweighs_both() -> None:
    said = stature_prior.settle(1.20, LENGTHS, trust.parse("camera", "test"), floor="unknown")
    assert (said.height_m, said.sigma, said.origin) == (1.20, stature_prior.GIVEN_SIGMA, "given")
    for height_m in (None, 1.9):
        measured = stature_prior.settle(height_m, CHILD, trust.parse("mocap", "test"), floor="level")
        assert (measured.height_m, measured.origin) == (None, "measured")
        assert measured.shown_m == pytest.approx(1.30, rel=0.03)


def test_one_camera_on_a_floor_that_nobody_knows_sees_an_adult(make: Makers, weights: Kinematics) -> None:
    walk = make.walking(30, 15.0, heading_rad=0.0)
    camera = make.looking_at(np.array([6.0, 0.0, 1.5]), np.array([2.0, 0.0, 1.0]))
    relative = make.in_camera(make.seen(walk, camera, noise_px=0.5, noise_m=0.005), relative=True)
    # the estimate is of a person of 1.36 m
    small = replace(relative, joints_m=0.78 * relative.joints_m, camera=Camera(camera.lens))
    fit = kinematics.fit(small, Scene(), weights)
    assert fit.body.height_m == pytest.approx(1.68, abs=0.05)
    assert 58.0 < fit.body.mass_kg < 66.0
