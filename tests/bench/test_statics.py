"""Formulas of the suite `contact`; tests/scene/test_physics.py has more of them."""

from __future__ import annotations

import pytest

from simrecon.bench import runner, schema, statics, suite


@pytest.mark.parametrize("check", suite.read("contact").check, ids=lambda check: check.name)
def test_the_checks_of_the_suite_are_met(check: schema.Check) -> None:
    found = runner.checked(check)
    assert found["met"], found
    assert abs(found["error_pct"]) <= check.within_pct


def test_a_check_that_is_off_is_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(statics.CHECKS, "sink", lambda **_: statics.Measured(1.03, 1.0, "m"))
    assert not runner.checked(schema.Check("a", "sink", 2.0, {}))["met"]
    assert runner.checked(schema.Check("a", "sink", 3.5, {}))["met"]


def test_a_person_who_sits_leans_on_seat_and_floor() -> None:
    person = statics._person(70.0, 1.75)
    qpos = statics._pose(person, flexed_rad=1.5708)
    seat = statics._seat(person, qpos)
    force = statics._held(person, qpos, statics.Scene(items=(seat,)), 0.01)  # (2, 3)
    assert force[:, 2].min() > 0.1 * 70 * statics.GRAVITY
