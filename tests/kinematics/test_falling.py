from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon import kinematics
from simrecon.geometry import camera as cameras
from simrecon.kinematics import falling
from simrecon.plan import Kinematics
from simrecon.types import Evidence, KinematicFit, Scene
from tests.kinematics.conftest import Makers
from tests.support import jumping


@pytest.fixture(scope="module")
def tall() -> Evidence:
    """Somebody of 1.90 m who jumps down by 1.2 m, before a camera that nobody has placed."""
    return jumping.seen(1.2, 0.5, 0.5, height_m=1.9)


@pytest.fixture(scope="module")
def fit(tall: Evidence, weights: Kinematics) -> KinematicFit:
    return kinematics.fit(tall, Scene(), kinematics.floating(weights))


def test_a_fall_says_how_tall_a_person_is(fit: KinematicFit) -> None:
    assert fit.body.height_m == pytest.approx(1.9, rel=0.03)  # it was 1.72 m by what adults are


def test_a_flight_of_the_right_size_changes_nothing(fit: KinematicFit) -> None:
    ((size, sigma),) = list(falling.flights(fit))
    assert abs(size) < 0.03
    assert 0.01 < sigma < 0.05
    small = replace(fit, com_m=0.8 * fit.com_m)
    ((grown, _),) = list(falling.flights(small))
    assert grown == pytest.approx(size + np.log(1 / 0.8), abs=0.005)


def test_only_who_falls_freely_is_in_flight(fit: KinematicFit) -> None:
    times = fit.times_s
    assert not list(falling.flights(replace(fit, com_m=np.tile(fit.com_m[0], (len(times), 1)))))
    bounce = np.stack((0 * times, 0 * times, 1 + 0.03 * np.sin(4 * np.pi * times)), axis=1)
    assert not list(falling.flights(replace(fit, com_m=bounce)))
    swung = fit.com_m.copy()
    swung[:, 0] += 2.0 * times**2  # somebody on a rope
    assert not list(falling.flights(replace(fit, com_m=swung)))


def test_nothing_is_said_where_the_size_is_known(tall: Evidence, fit: KinematicFit, make: Makers) -> None:
    assert falling.stature_m(tall, fit) is not None
    assert falling.stature_m(replace(tall, height_m=1.9), fit) is None
    assert tall.camera is not None
    camera = make.looking_at(np.array([1.5, -5.0, 1.4]), np.array([0.5, 0.0, 1.0]))
    assert falling.stature_m(replace(tall, camera=cameras.lasting(camera, len(tall.times_s))), fit) is None
