"""A body whose bones are not those that motion capture measured is refused, or named."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import evidence, kinematics
from simrecon import plan as plans
from simrecon.errors import InputError
from simrecon.kinematics import bones
from simrecon.types import Evidence, Scene

CASE = Path(__file__).resolve().parents[1] / "data" / "cases" / "bvh_height_1m71.bvh"


@pytest.fixture(scope="module")
def capture() -> Evidence:
    """Motion capture of a person of 1.71 m, whose stature nobody says."""
    return replace(evidence.read(CASE), height_m=None)


def test_the_body_that_was_measured_has_its_bones(capture: Evidence) -> None:
    off = bones.apart(capture, bodies.scaled(bodies.measure(capture)))
    assert set(off) == {"hip_width", "upper_arm", "forearm", "thigh", "shank"}
    assert max(map(abs, off.values())) < 0.01


def test_bones_of_another_size_are_named(capture: Evidence) -> None:
    small = bodies.rescaled(bodies.scaled(bodies.measure(capture)), 0.8)
    assert bones.apart(capture, small)["thigh"] == pytest.approx(-0.2, abs=0.01)
    bones.check(capture, small)
    tall = bodies.rescaled(bodies.scaled(bodies.measure(capture)), 1.4)
    with pytest.raises(InputError, match=r"of the body: found .* \(\+4\d %\); valid: up to 35 % apart"):
        bones.check(capture, tall)


def test_a_shape_of_another_person_is_refused_before_the_fit(capture: Evidence) -> None:
    other = bodies.ShapeRequest(np.zeros(10))
    weights = replace(plans.read("quick").kinematics, evaluations=0)
    with pytest.raises(InputError, match="where the motion capture has"):
        kinematics.fit(replace(capture, height_m=0.9), Scene(), weights, other)


@pytest.mark.parametrize(("height_m", "refused"), [(1.75, False), (1.4, False), (0.9, True)])
def test_a_stature_of_another_person_is_refused(capture: Evidence, height_m: float, refused: bool) -> None:
    """The bones are the measured ones, but all that is thick would be another person's."""
    own, said = bodies.scaled(bodies.measure(capture)), replace(capture, height_m=height_m)
    assert bones.apart(said, own)["stature"] == pytest.approx(height_m / 1.64 - 1, abs=0.01)
    if not refused:
        bones.check(said, own)
        return
    with pytest.raises(InputError, match=r"stature of the body: found 0\.9 m"):
        bones.check(said, own)


def test_what_one_camera_estimates_measures_no_bone(capture: Evidence) -> None:
    tall = bodies.rescaled(bodies.scaled(bodies.measure(capture)), 1.5)
    seen = replace(capture, trust="world")
    assert bones.apart(seen, tall) == {}
    bones.check(seen, tall)
