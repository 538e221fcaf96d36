"""Contact by force: a person who stands on both feet, as plates of the simulator feel it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon.evaluation import pushes
from simrecon.evaluation.comparison import Comparison, comparison, track
from simrecon.metrics.truth import Pushes
from simrecon.types import Scene
from tests.support.standing import NAMES, standing

TIMES = np.arange(31) / 30
PARTS = tuple(
    part.name for part in bodies.build(bodies.scaled({}, 1.7), height_m=1.7, mass_kg=70.0).primitives
)


@pytest.fixture(scope="module")
def on() -> Comparison:
    still = np.repeat(standing()[None], len(TIMES), axis=0)
    return comparison(track(TIMES, NAMES, still, "reference"), TIMES, Scene())


def pushed(*parts: str, force_N: float = 300.0) -> Any:
    """A motion in which the scene pushes these parts up."""
    force = np.zeros((len(TIMES), len(PARTS), 3))
    force[:, [PARTS.index(part) for part in parts], 2] = force_N
    return SimpleNamespace(times_s=TIMES, contact_body=PARTS, contact_force_N=force)


def f1(*parts: str, on: Comparison, force_N: float = 300.0) -> float:
    return pushes.contact_f1(pushed(*parts, force_N=force_N), on)["contact_f1_force"]


def test_who_is_pushed_where_the_reference_touches_has_it_right(on: Comparison) -> None:
    motion = pushed("left_foot", "right_foot")
    assert pushes.contact_f1(motion, on) == {"contact_f1_force": 1}
    assert pushes.touch_f1(motion, on) == pytest.approx(
        dict.fromkeys((f"touch_f1_force{part}" for part in ("", "_least", "_left_foot", "_right_foot")), 1.0)
    )


def test_a_foot_in_the_air_is_a_miss_and_so_is_a_hand_on_the_floor(on: Comparison) -> None:
    assert f1("left_foot", on=on) == pytest.approx(1 / 2)
    assert pushes.touch_f1(pushed("left_foot"), on)["touch_f1_force_right_foot"] == 0
    assert f1("left_foot", "right_foot", "right_hand", on=on) == pytest.approx(2 / 3)
    assert f1("left_foot", "right_foot", force_N=19.0, on=on) == 0


def test_what_pushes_a_simulated_reference_is_what_touches(on: Comparison) -> None:
    """The right foot stands as near as the left one, but bears nothing in the second half of the clip."""
    motion = pushed("left_foot", "right_foot")
    forces = Pushes(PARTS, motion.contact_force_N.copy())
    forces.force_N[16:, PARTS.index("right_foot")] = 0.0
    known = comparison(on.truth, TIMES, Scene(), pushes=forces)
    right = 2 * 16 / (16 + 31)
    assert pushes.true_contact_f1(known.touching, known) == {
        "contact_f1_true": pytest.approx((1 + right) / 2)
    }
    assert pushes.contact_f1(motion, known)["contact_f1_true_force"] == pytest.approx((1 + right) / 2)
    motion.contact_force_N = forces.force_N
    assert pushes.contact_f1(motion, known)["contact_f1_true_force"] == 1
    assert pushes.true_contact_f1(on.touching, on) == {}
