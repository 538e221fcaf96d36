from __future__ import annotations

import pytest

from simrecon.metrics import anthropometry
from tests.support.standing import NAMES, standing


def test_centre_of_mass_and_stature_of_the_template() -> None:
    """A standing person's centre of mass is at 55 to 57 % of stature (Winter 2009); arms are level here."""
    body = standing()
    assert anthropometry.stature_m(NAMES, body[None]) == pytest.approx(1.7, rel=0.04)
    com = anthropometry.centre_of_mass(NAMES, body)
    assert 0.54 < com[2] / 1.7 < 0.62
    assert com[1] == pytest.approx(0, abs=1e-9)


def test_entries_of_the_left_stand_for_both_sides() -> None:
    capsules = {entry["name"]: entry for entry in anthropometry.entries("capsule")}
    assert capsules["right_thigh"]["from"] == ["right_hip"]
    assert capsules["left_thigh"]["from"] == ["left_hip"]
    assert "right_pelvis" not in capsules
