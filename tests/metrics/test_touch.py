"""Touch within 2 cm, at rest or moving."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon.metrics import touch
from simrecon.metrics.definitions import DEFINITIONS

CAPSULES = ("pelvis", "trunk", "left_forearm", "left_heel", "left_toe")


def test_a_part_touches_with_any_of_its_capsules() -> None:
    clearance = np.array([[0.3, 0.019, 0.5, 0.5, -0.1], [0.3, 0.021, 0.0, 0.5, 0.03]])
    found = touch.near(clearance, CAPSULES)
    names = list(touch.PARTS)
    assert [names[k] for k in np.flatnonzero(found[0])] == ["back", "left_foot"]
    assert [names[k] for k in np.flatnonzero(found[1])] == ["left_arm"]


def test_f1_counts_parts_that_the_reference_touches_with() -> None:
    """The back for four frames, found in three of them and one beside; a foot for two, which is too few."""
    wanted, found = np.zeros((2, 8, len(touch.PARTS)), bool)
    back, foot = list(touch.PARTS).index("back"), list(touch.PARTS).index("left_foot")
    wanted[2:6, back], found[3:7, back] = True, True
    wanted[:2, foot] = True
    scores = touch.scores(found, wanted)
    assert scores == pytest.approx({"touch_f1": 0.75, "touch_f1_least": 0.75, "touch_f1_back": 0.75})
    assert touch.scores(found, np.zeros_like(wanted)) == {}
    assert set(scores) <= set(DEFINITIONS)


def test_every_part_has_a_definition() -> None:
    for prefix in ("touch_f1", "touch_f1_force"):
        assert {prefix, f"{prefix}_least", *(f"{prefix}_{name}" for name in touch.PARTS)} <= set(DEFINITIONS)
