"""The body is as tall as the person is known to be, though its lengths are found otherwise than measured."""

from __future__ import annotations

from dataclasses import replace

import pytest

from simrecon import evidence, kinematics, plan, resources
from simrecon.body import primitives
from simrecon.evidence import resample
from simrecon.types import Evidence, Scene

HEIGHT_M = 1.72
WEIGHTS = kinematics.floating(plan.read("quick").kinematics)


@pytest.fixture(scope="module")
def clip() -> Evidence:
    """The first third of a second of the example."""
    seen = evidence.read(resources.folder("example") / "beam.npz")
    return resample(replace(evidence.cut(seen, slice(0, 20)), height_m=HEIGHT_M))[0]


def test_a_known_stature_is_that_of_the_body(clip: Evidence) -> None:
    once = kinematics.fit(clip, Scene(), WEIGHTS)
    again = kinematics.fit_to_stature(clip, Scene(), WEIGHTS)
    off, less = (abs(primitives.upright_m(fit.body) - HEIGHT_M) for fit in (once, again))
    assert off > 0.001  # to first order only
    assert less < min(off, 0.001 * HEIGHT_M)


def test_without_a_stature_it_is_the_fit(clip: Evidence) -> None:
    unknown = replace(clip, height_m=None)
    once = kinematics.fit(unknown, Scene(), WEIGHTS)
    again = kinematics.fit_to_stature(unknown, Scene(), WEIGHTS)
    assert (once.qpos == again.qpos).all()
