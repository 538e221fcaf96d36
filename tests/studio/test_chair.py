"""The chair story on a real video's evidence: nothing is known of the scene; then a seat bears the person."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from simrecon.job import Job, Reading
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
SITS_S, SEEN_S = 2.5, 3.2
"""When they sit in what is shown, and how much that is: they stand up and sit down in it."""
LOWER_M = 0.03
FITTED_S, SOLVED_S = 600.0, 1800.0
"""How long it may take on a machine that is busy with other work."""
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
    (seat,) = (one.item for one in needed.suggestions)  # and no step under the feet, which are on the floor
    assert seat.kind == "chair"
    name = tab.document.put(seat)
    height = float(str(seat.parameters["seat_height_m"]))
    tab.document.set(name, {"seat_height_m": round(height - LOWER_M, 3)})
    run = tab.start(Wanted("quick", None, UNTIL_S))
    assert run.wait(SOLVED_S)
    assert run.progress.state == runs.DONE, run.progress.message
    bears(tab)
    assert tab.after is not None
    assert tab.after.result.scene.items[0].parameters["seat_height_m"] == pytest.approx(height - LOWER_M)


def test_the_chair_story_in_a_browser(
    shared_data: Path, page: Page, tmp_path: Path, shots: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Open the first seconds, suggest, add, lower by hand, run, look at the seat's force, save."""
    from simrecon.studio.app import Studio

    shutil.copy(shared_data / "evidence" / CLIP, tmp_path)
    monkeypatch.chdir(tmp_path)  # the page, and its pictures, show the path
    session = Session()
    session.open(Path(CLIP), Job("", "", reading=Reading(to_s=SEEN_S)))
    studio = Studio(session)
    try:
        page.open(f"{studio.address}&fixedDpr=1", FITTED_S)
        session.player.seek(SITS_S)
        shoot(page, studio, shots / "sits.png")
        tab = session.current
        assert tab is not None
        page.unfold("What the motion needs")
        page.press("Suggest")
        page.until(lambda: page.says("Add what is suggested"), "a suggestion", FITTED_S)
        page.show("Add what is suggested")
        shoot(page, studio, shots / "suggested.png")
        page.press("Add what is suggested")
        page.until(lambda: tab.document.scene.items, "the chair")
        (chair,) = tab.document.scene.items  # and no step under the feet, which are on the floor
        height = round(float(str(chair.parameters["seat_height_m"])) - LOWER_M, 3)
        page.fill("seat height, m", f"{height:g}")
        page.until(lambda: tab.document.scene.items[0].parameters["seat_height_m"] == height, "the height")
        shoot(page, studio, shots / "lower.png")
        page.turn_to("Run")
        page.press("Run")
        page.until(lambda: tab.after, "the run", SOLVED_S)
        page.until(lambda: page.says("force on the seat, N"), "the table")
        session.player.seek(SITS_S)
        page.show("Discard B")
        shoot(page, studio, shots / "seat.png")
        page.turn_to("Save")
        page.fill("scene", "room.toml")
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
    page.dismiss()
    time.sleep(2.0)
    page.shot(path)
