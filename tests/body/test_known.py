"""A person read back from a model, and changed."""

from __future__ import annotations

import re
from dataclasses import asdict

import mujoco
import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import scene as scenes
from simrecon.body import known, mass
from simrecon.errors import InputError
from simrecon.types import Body, Scene

BODIES = {
    "lengths": lambda: bodies.build(bodies.scaled({}, 1.75), height_m=1.75, mass_kg=70.0),
    "betas": lambda: bodies.build(betas=np.array([1.0, -0.5]), distribution="heavy_arms", mass_kg=146.0),
}


def share(body: Body, segments: tuple[str, ...]) -> float:
    """Of the mass that MuJoCo gives to these segments."""
    model = mujoco.MjModel.from_xml_string(body.mjcf)
    return sum(model.body(name).mass[0] for name in segments) / model.body_mass.sum()


@pytest.mark.parametrize("which", BODIES)
def test_a_person_is_read_back_from_the_model_of_a_result(which: str) -> None:
    body = BODIES[which]()
    again = known.of_mjcf(scenes.build(body.mjcf, Scene(), 0.01), body.height_m)
    for key, value in asdict(body.skeleton).items():
        if key.endswith("names"):
            assert getattr(again.skeleton, key) == value
        else:
            np.testing.assert_allclose(getattr(again.skeleton, key), value, atol=1e-6)
    for part, copy in zip(body.primitives, again.primitives, strict=True):
        assert (copy.name, copy.segment, copy.kind) == (part.name, part.segment, part.kind)
        np.testing.assert_allclose(copy.points_m, part.points_m, atol=1e-6)
        np.testing.assert_allclose(copy.size_m, part.size_m, atol=1e-6)
        assert copy.mass_kg == pytest.approx(part.mass_kg, abs=1e-9)
    assert again.mass_kg == pytest.approx(body.mass_kg, abs=1e-6)


def test_what_is_no_person_is_refused() -> None:
    for text in ("<mujoco><worldbody/></mujoco>", "no model"):
        with pytest.raises(InputError, match="valid: the model of a result"):
            known.of_mjcf(text, 1.7)


@pytest.mark.parametrize("turn", ["0 0 0 0", "nan 0 0 0", "inf 0 0 0"])
def test_a_body_without_an_orientation_is_refused(turn: str) -> None:
    body = BODIES["lengths"]()
    text = re.sub(r'(<body name="neck"[^>]* quat=")[^"]*', rf"\g<1>{turn}", body.mjcf)
    assert text != body.mjcf
    with pytest.raises(InputError, match="valid: the model of a result"):
        known.of_mjcf(text, 1.7)


@pytest.mark.parametrize("name", mass.distributions())
def test_mass_and_its_distribution_are_changed(name: str) -> None:
    distribution = mass.distribution(name)
    body = known.changed(BODIES["lengths"](), height_m=1.4, mass_kg=distribution.mass_kg, distribution=name)
    model = mujoco.MjModel.from_xml_string(body.mjcf)
    assert model.body_mass.sum() == pytest.approx(distribution.mass_kg, abs=1e-6)
    if distribution.segments:
        assert share(body, distribution.segments) == pytest.approx(distribution.share, abs=1e-5)
    assert body.height_m == pytest.approx(1.4)
    assert body.mass_kg == distribution.mass_kg
    assert bodies.stature_m(body.skeleton) == pytest.approx(1.4)
    assert known.leg_m(body.skeleton) == pytest.approx(0.8 * known.leg_m(BODIES["lengths"]().skeleton))


def test_without_wishes_shares_stay_and_mass_follows_volume() -> None:
    before = BODIES["betas"]()
    same, small = known.changed(before), known.changed(before, height_m=0.5 * before.height_m)
    arms = mass.distribution("heavy_arms").segments
    assert share(same, arms) == pytest.approx(0.36, abs=1e-5)
    assert same.mass_kg == pytest.approx(146.0)
    assert small.mass_kg == pytest.approx(146.0 / 8)
    np.testing.assert_allclose(small.primitives[0].size_m, 0.5 * before.primitives[0].size_m)
    assert small.shape_space == before.shape_space == "simrecon"
    np.testing.assert_array_equal(small.betas, before.betas)
