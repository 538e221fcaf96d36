"""The chair story on a real video's evidence: nothing is known of the scene; then a seat bears the person."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from simrecon.studio import opening, runs
from simrecon.studio.asking import Wanted
from simrecon.studio.comparing import SEAT
from simrecon.studio.tab import Tab

UNTIL_S = 5.0
"""The person sits down and stands up in it."""
LOWER_M = 0.03


@pytest.mark.slow
def test_a_chair_is_suggested_lowered_by_hand_and_bears_the_person(
    shared_data: Path, open_tab: Callable[..., Tab]
) -> None:
    path = shared_data / "evidence" / "opencap_STS_blazepose.npz"
    tab = open_tab(path, opening.base_of(path))
    tab.load()
    assert tab.failure == ""
    assert tab.clip is not None
    needed = opening.needed(tab.base, tab.clip, tab.document.scene)
    (seat,) = (one.item for one in needed.suggestions if one.item.kind == "chair")
    name = tab.document.put(seat)
    height = float(str(seat.parameters["seat_height_m"]))
    tab.document.set(name, {"seat_height_m": round(height - LOWER_M, 3)})
    run = tab.start(Wanted("quick", None, UNTIL_S))
    assert run.wait(1200)
    assert run.progress.state == runs.DONE, run.progress.message
    assert tab.after is not None
    motion, mass_kg = tab.after.result.motion, tab.after.clip.body.mass_kg
    rows = [motion.contact_body.index(part) for part in SEAT]
    force = motion.contact_force_N[:, rows, 2].sum(axis=1)
    sat = force > 0.3 * mass_kg * 9.81
    assert sat.mean() > 0.05
    assert tab.after.result.scene.items[0].parameters["seat_height_m"] == pytest.approx(height - LOWER_M)
