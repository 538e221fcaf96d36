"""A person in the air falls at 9.8 m/s², if the file's frame rate is right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon.evidence import flight, plausible
from simrecon.types import Evidence
from tests.evidence.test_plausible import person


def jumping(rate_hz: float, flight_s: float = 0.5) -> Evidence:
    """Stands, is in the air, stands again, at 100 Hz by the true clock; the file says another rate."""
    times = np.arange(150) / 100
    aloft = np.clip(times - 0.4, 0.0, flight_s)
    height = 0.5 * flight.GRAVITY_MPS2 * aloft * (flight_s - aloft)
    still = person().joints_m[:1]
    joints = np.repeat(still, len(times), axis=0)
    joints[..., 2] += height[:, None]
    return replace(person(), times_s=np.arange(150) / rate_hz, joints_m=joints)


@pytest.mark.parametrize("rate_hz", [80.0, 100.0, 125.0])
def test_a_jump_in_its_own_time_passes_without_a_word(rate_hz: float) -> None:
    assert flight.check(jumping(rate_hz)) == ""


@pytest.mark.parametrize("rate_hz", [200.0, 400.0])
def test_a_jump_that_is_played_too_fast_is_said_with_the_rate_that_is_right(rate_hz: float) -> None:
    said = flight.check(jumping(rate_hz))
    assert said.startswith(f"frame rate: found a person in the air from {40 / rate_hz:.2f}"[:45])
    assert f"as at about --fps 100 instead of {rate_hz:.0f}" in said
    assert said in plausible.checked(jumping(rate_hz), "clip.bvh").reading.splitlines()


def test_hops_and_joints_that_are_not_seen_say_nothing() -> None:
    assert flight.check(jumping(400.0, flight_s=0.2)) == ""  # 5 cm high
    blind = jumping(400.0)
    joints = blind.joints_m.copy()
    joints[:, :, 2] = np.nan
    assert flight.check(replace(blind, joints_m=joints)) == ""
    arms = [k for k, name in enumerate(blind.joint_names) if "elbow" in name or "wrist" in name]
    names = tuple(blind.joint_names[k] for k in arms)
    assert flight.check(replace(blind, joint_names=names, joints_m=blind.joints_m[:, arms])) == ""
