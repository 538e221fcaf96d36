"""The search for a floor's stiffness and damping."""

from __future__ import annotations

import math

import pytest

from simrecon import scene as scenes
from simrecon import softfloor
from simrecon.errors import InputError
from simrecon.pipeline import Reconstruction
from simrecon.types import Motion, Scene


def test_golden_section_finds_a_minimum() -> None:
    seen = []

    def function(x: float) -> float:
        seen.append(x)
        return (x - 1.3) ** 2

    assert softfloor.golden(function, 0.0, 4.0, 16) == pytest.approx(1.3, abs=0.01)
    assert len(seen) == 16
    assert len(set(seen)) == 16


@pytest.mark.parametrize(("stiffness", "ratio"), [(2e4, 0.2), (8e3, 0.6), (1e5, 0.1)])
def test_the_search_finds_stiffness_and_damping(stiffness: float, ratio: float) -> None:
    def loss(k: float, z: float) -> float:
        return math.log(k / stiffness) ** 2 + 0.1 * math.log(z / ratio) ** 2

    found = softfloor.search(loss)
    assert math.log(found[0] / stiffness) == pytest.approx(0, abs=0.15)
    assert math.log(found[1] / ratio) == pytest.approx(0, abs=0.4)


def test_a_loss_that_is_infinite_in_places_is_no_trouble() -> None:
    found = softfloor.search(lambda k, _: math.inf if k < 2e4 else math.log(k / 4e4) ** 2)
    assert found[0] == pytest.approx(4e4, rel=0.2)


def test_only_a_ground_that_asks_for_it_is_calibrated() -> None:
    def never(_scene: Scene, _start: Motion | None) -> Reconstruction:
        raise AssertionError("simulated")

    with pytest.raises(InputError, match='valid: "fit"'):
        softfloor.calibrate(never, Scene(), None)
    with pytest.raises(InputError, match="stiffness_Npm"):
        scenes.build("<mujoco/>", scenes.parse('[ground]\nstiffness_Npm = "fit"'), 0.01)
