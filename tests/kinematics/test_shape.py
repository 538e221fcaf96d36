"""The kinematic fit of a body of known or fitted shape."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import evidence, kinematics, plan, resources, scene
from simrecon.body import shape
from simrecon.evidence import resample
from simrecon.types import Evidence, KinematicFit


@pytest.fixture(scope="module")
def clip() -> Evidence:
    clip = evidence.read(resources.folder("example") / "beam.npz")
    return resample(replace(clip, mass_kg=60.0))[0]


def fitted(clip: Evidence, request: bodies.ShapeRequest | None, *, poses: bool = True) -> KinematicFit:
    room = scene.read(resources.folder("example") / "beam.toml")
    settings = replace(plan.read("quick").kinematics, evaluations=30, poses=poses)
    return kinematics.fit(clip, room, settings, request)


def test_given_betas_make_the_body(clip: Evidence) -> None:
    betas = np.array([-0.5, 1.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    fit = fitted(replace(clip, height_m=1.75), bodies.ShapeRequest(betas))
    np.testing.assert_array_equal(fit.body.betas, betas)
    assert fit.body.height_m == pytest.approx(1.75, rel=0.05)
    assert mujoco.MjModel.from_xml_string(fit.body.mjcf).body_mass.sum() == pytest.approx(60.0, abs=1e-6)
    own = bodies.measure_template(shape.skeleton(betas))
    lengths = bodies.measure_template(fit.body.skeleton)
    np.testing.assert_allclose([lengths[n] / own[n] for n in own], lengths["thigh"] / own["thigh"], rtol=1e-6)


def test_the_shape_is_found_from_the_evidence(clip: Evidence) -> None:
    fit = fitted(clip, bodies.ShapeRequest(distribution="heavy_head"))
    assert np.abs(fit.body.betas).max() > 0.05
    head = sum(part.mass_kg for part in fit.body.primitives if part.segment == "head")
    assert head / fit.body.mass_kg == pytest.approx(0.4, abs=1e-5)
    # without a search, which may change lengths: the measured ones are those of either body
    fit, before = (fitted(clip, request, poses=False) for request in (bodies.ShapeRequest(), None))
    assert len(before.body.betas) == 0
    measured = bodies.measure_template(fit.body.skeleton)
    ratio = [measured[n] / value for n, value in bodies.measure_template(before.body.skeleton).items()]
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-6)
