"""The chair story on a real video's evidence: nothing is known of the scene; then a seat bears the person."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from simrecon.scene import read
from simrecon.studio import opening, runs
from simrecon.studio.asking import Wanted
from simrecon.studio.comparing import SEAT
from simrecon.studio.session import Session
from simrecon.studio.tab import Tab
from tests.support import browser
from tests.support.browser import Page

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default")]
UNTIL_S = 5.0
"""The person sits down and stands up in it."""
SITS_S = 2.5
LOWER_M = 0.03
SOLVED_S = 1200.0
CLIP = "opencap_STS_blazepose.npz"


def bears(tab: Tab) -> None:
    """The seat of the last run bears the person."""
    assert tab.after is not None
    motion, mass_kg = tab.after.result.motion, tab.after.clip.body.mass_kg
    rows = [motion.contact_body.index(part) for part in SEAT]
    force = motion.contact_force_N[:, rows, 2].sum(axis=1)
    sat = force > 0.3 * mass_kg * 9.81
    assert sat.mean() > 0.05


def test_a_chair_is_suggested_lowered_by_hand_and_bears_the_person(
    shared_data: Path, open_tab: Callable[..., Tab]
) -> None:
    path = shared_data / "evidence" / CLIP
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
    assert run.wait(SOLVED_S)
    assert run.progress.state == runs.DONE, run.progress.message
    bears(tab)
    assert tab.after is not None
    assert tab.after.result.scene.items[0].parameters["seat_height_m"] == pytest.approx(height - LOWER_M)


def test_the_chair_story_in_a_browser(shared_data: Path, page: Page, tmp_path: Path, shots: Path) -> None:
    """Open, suggest, add, lower by hand, run the first seconds, compare, save."""
    from simrecon.studio.app import Studio

    session = Session()
    session.open(shared_data / "evidence" / CLIP)
    studio = Studio(session)
    try:
        page.open(f"{studio.address}&fixedDpr=1", 240.0)
        session.player.seek(SITS_S)
        shoot(page, studio, shots / "sits.png")
        tab = session.current
        assert tab is not None
        page.unfold("What the motion needs")
        page.press("Suggest")
        page.until(lambda: page.says("Add what is suggested"), "a suggestion", 120.0)
        shoot(page, studio, shots / "suggested.png")
        page.press("Add what is suggested")
        page.until(lambda: tab.document.scene.items, "the chair")
        (chair,) = tab.document.scene.items
        height = round(float(str(chair.parameters["seat_height_m"])) - LOWER_M, 3)
        page.fill("seat height, m", f"{height:g}")
        page.until(lambda: tab.document.scene.items[0].parameters["seat_height_m"] == height, "the height")
        shoot(page, studio, shots / "lower.png")
        page.choose_range(0.0, UNTIL_S)
        page.until(lambda: session.player.loop, "the range")
        page.turn_to("Run")
        page.tick("the loop's range alone")
        page.press("Run")
        page.until(lambda: tab.after, "the run", SOLVED_S)
        page.until(lambda: page.says("force on the seat, N"), "the table")
        session.player.seek(SITS_S)
        shoot(page, studio, shots / "seat.png")
        page.turn_to("Save")
        page.fill("scene", str(tmp_path / "room.toml"))
        time.sleep(1.0)
        page.press("Save scene")
        browser.wait_for(tmp_path / "room.toml")
        assert read(tmp_path / "room.toml").items[0].parameters["seat_height_m"] == height
        bears(tab)
    finally:
        studio.stop()


def shoot(page: Page, studio: Any, path: Path) -> None:
    """A picture of the page, once it is drawn."""
    studio._wake()
    time.sleep(2.0)
    page.dismiss()
    page.shot(path)
