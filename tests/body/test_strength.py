"""Torque limits of weaker and stronger people."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import plan as plans
from simrecon.body import strength


@pytest.fixture(scope="module")
def mjcf() -> str:
    return bodies.build(bodies.scaled({}, 1.7), height_m=1.7, mass_kg=60.0).mjcf


def test_every_strength_of_a_plan_is_there() -> None:
    assert set(strength.factors()) == set(plans.STRENGTHS)
    assert strength.factors()["usual"] == 1.0


def test_trained_people_have_higher_limits_and_nothing_else(mjcf: str) -> None:
    usual, trained = (
        mujoco.MjModel.from_xml_string(strength.strengthened(mjcf, name)) for name in ("usual", "trained")
    )
    factor = strength.factors()["trained"]
    assert factor > 1.1
    np.testing.assert_allclose(trained.actuator_forcerange, factor * usual.actuator_forcerange, rtol=1e-5)
    np.testing.assert_allclose(trained.actuator_gainprm, usual.actuator_gainprm, rtol=1e-5)
    np.testing.assert_allclose(trained.body_mass, usual.body_mass, rtol=1e-5)
    assert trained.opt.integrator == usual.opt.integrator


def test_usual_people_stay_to_the_bit(mjcf: str) -> None:
    assert strength.strengthened(mjcf, "usual") == mjcf
