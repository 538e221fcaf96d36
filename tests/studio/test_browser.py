"""The stories of the studio in a real browser; the pictures are those of docs/studio.md."""

from __future__ import annotations

import os
import re
import shutil
import time
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import cli
from simrecon import scene as scenes
from simrecon.geometry import rotations
from simrecon.results import motion_file, open_result
from simrecon.studio.session import Session
from tests.support import browser
from tests.support.browser import Page

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default")]
GRIP_M = 0.6
"""Where an arrow of the gizmo is grabbed, from its middle."""


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The demo, solved quickly."""
    folder = tmp_path_factory.mktemp("demo") / "demo"
    assert cli.main(["demo", "--plan", "quick", "-o", str(folder)]) == 0
    return folder


@pytest.fixture(scope="module")
def long_clip(demo: Path) -> Path:
    """A result of ten seconds: the demo's motion, there and back."""
    result = open_result(demo)
    motion, folder = result.motion, demo.parent / "long"
    rows = np.concatenate([np.arange(100), np.arange(100)[::-1]] * 3)
    arrays = {
        item.name: value[rows] if np.shape(value)[:1] == (100,) else value
        for item in fields(motion)
        if (value := getattr(motion, item.name)) is not None
    }
    step = float(np.median(np.diff(motion.times_s)))
    long = replace(motion, **{**arrays, "times_s": step * np.arange(len(rows))})
    shutil.copytree(demo, folder)
    (folder / "motion.npz").write_bytes(motion_file.dumps(long))
    return folder


def in_page(studio: Any, point_m: Any) -> tuple[float, float]:
    """Where a point of the world is in the page, as the browser's camera has it."""
    (client,) = studio._server.viser.get_clients().values()
    eye = client.camera
    local = rotations.matrix(np.asarray(eye.wxyz)[None])[0].T @ (np.asarray(point_m) - eye.position)
    scale = eye.image_height / 2 / np.tan(eye.fov / 2)
    return (
        float(eye.image_width / 2 + scale * local[0] / local[2]),
        float(eye.image_height / 2 + scale * local[1] / local[2]),
    )


def drag_along(page: Page, studio: Any, name: str, axis: int, by_m: float) -> None:
    """Drag an item by an arrow of the gizmo."""
    start = np.array(studio.session.current.document.item(name).position_m)
    along = np.eye(3)[axis]
    grip = start + GRIP_M * along
    places = [in_page(studio, grip + share * by_m * along) for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
    page.drag(*places)
    page.until(
        lambda: (
            np.abs(np.subtract(studio.session.current.document.item(name).position_m, start)).max() > 0.05
        ),
        f"{name} to move",
    )


def test_a_bench_under_the_person(
    page: Page, demo: Path, tmp_path: Path, shots: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Open the demo, add a bench, drag it under the person, see the penetration go, run, compare, save."""
    from simrecon.studio.app import Studio

    monkeypatch.chdir(demo.parent)
    session = Session()
    session.open(Path("demo"))
    studio = Studio(session)
    try:
        page.open(f"{studio.address}&fixedDpr=1")
        page.until(lambda: session.current and session.current.seen, "the camera")
        page.until(studio._server.viser.get_clients, "viser's page")
        time.sleep(2.0)
        page.dismiss()
        page.shot(shots / "open.png")
        page.press("Add at the person")
        page.until(lambda: "bench" in page.inside(), "the bench to be inside")
        time.sleep(1.0)
        page.shot(shots / "bench.png")
        drag_along(page, studio, "bench", 1, -1.4)
        page.until(lambda: "bench" not in page.inside(), "the penetration to go")
        time.sleep(1.0)
        page.shot(shots / "aside.png")
        page.fill("size, m", "0.02", 2)
        page.until(lambda: session.current.document.item("bench").parameters["size_m"][2] == 0.02, "the size")  # type: ignore[union-attr,index]
        drag_along(page, studio, "bench", 1, 1.4)
        time.sleep(1.0)
        page.shot(shots / "under.png")
        assert "bench" not in page.inside()
        page.turn_to("Run")
        page.press("Run")
        page.until(lambda: session.current and session.current.preview, "the first windows")
        time.sleep(0.5)
        page.shot(shots / "running.png")
        page.until(lambda: session.current and session.current.after, "the run", 300.0)
        page.until(lambda: page.says(" better, "), "the table")
        page.script("document.querySelector('#studio-canvas').scrollIntoView()")
        session.player.seek(0.9)
        studio._wake()
        time.sleep(2.0)
        page.shot(shots / "compare.png")
        page.turn_to("Save")
        save: Any = studio._panels[4]
        page.fill("scene", "room.toml")
        page.until(lambda: save._scene.value == "room.toml", "the path of the scene")
        page.press("Save scene")
        page.fill("job", "job.toml")
        page.until(lambda: save._job.value == "job.toml", "the path of the job")
        page.press("Save job")
        browser.wait_for(demo.parent / "room.toml")
        browser.wait_for(demo.parent / "job.toml")
        time.sleep(1.0)
        page.shot(shots / "save.png")
        assert scenes.read(demo.parent / "room.toml").items[-1].name == "bench"
        assert session.current is not None
        assert session.current.after is not None
        first = session.current.after.result.folder / "motion.npz"
        again = tmp_path / "again"
        assert cli.main(["run", "--job", str(demo.parent / "job.toml"), "-o", str(again)]) in (0, 3)
        assert first.read_bytes() == (again / "motion.npz").read_bytes()
    finally:
        studio.stop()


RUN = re.compile(r"(\d+) of (\d+) windows")


def solved(page: Page) -> int:
    """How many windows the page says are solved."""
    found = RUN.search(page.state()["run"])
    return int(found[1]) if found else 0


def test_a_kill_loses_nothing(page: Page, demo: Path, tmp_path: Path) -> None:
    """What is edited and solved in a studio that is killed is there in the next one, with the same bits."""
    cache = tmp_path / "cache"
    with browser.served(demo, cache=cache) as studio:
        page.open(studio.address)
        page.press("Add at the person")
        page.until(lambda: "bench" in page.inside(), "the bench")
        page.fill("place, m", "2", 0)
        page.until(lambda: "bench" not in page.inside(), "the bench to be gone from there")
        page.fill("name", "shelf")
        time.sleep(1.0)
        page.press("Rename")
        page.until(lambda: page.says("Item shelf"), "the other name")
        page.script(MODE, "left_toe", "grounded")
        page.until(lambda: "left_toe" in page.state()["undo"], "the mode")
        page.turn_to("Run")
        page.press("Run")
        page.until(lambda: solved(page) >= 1, "a window", 200.0)
        before = solved(page)
        studio.kill()
    with browser.served(demo, cache=cache) as studio:
        page.open(studio.address)
        assert page.says("of an earlier studio were taken up again")
        assert page.state()["unsaved"]
        modes = {part["name"]: part["mode"] for part in page.script("return window.__clip.parts")}
        assert modes["left_toe"] == "grounded"
        page.turn_to("Run")
        page.press("Run")
        page.until(lambda: solved(page) >= 1, "the windows that were solved", 60.0)
        assert solved(page) >= before
        page.until(lambda: page.says(" better, "), "the table", 300.0)
        page.turn_to("Save")
        page.fill("job", str(tmp_path / "job.toml"))
        time.sleep(1.0)
        page.press("Save job")
        browser.wait_for(tmp_path / "job.toml")
    (made,) = cache.glob("studio/*/*/runs/*/motion.npz")
    assert [item.name for item in open_result(made.parent).scene.items][-1] == "shelf"
    again = tmp_path / "again"
    assert cli.main(["run", "--job", str(tmp_path / "job.toml"), "-o", str(again)]) in (0, 3)
    assert made.read_bytes() == (again / "motion.npz").read_bytes()


MODE = """
const menu = document.querySelector(`#studio-modes [data-part=${arguments[0]}]`);
menu.value = arguments[1]; menu.dispatchEvent(new Event("change", { bubbles: true }));
"""

USABLE_S, FRAMES_HZ, EDIT_S = 3.0, 20.0, 0.2


def test_it_is_quick(page: Page, long_clip: Path, tmp_path: Path) -> None:
    """From the command to a page that can be used; scrubbing through ten seconds; an edit: best of three.

    Chromium draws on the processor here, and a machine that is busy with other work measures that work.
    """
    usable, drawn, edits = [], [], []
    for _ in range(3):
        with browser.served(long_clip, cache=tmp_path / "cache") as studio:
            page.open(studio.address)
            usable.append(time.monotonic() - studio.began)
            time.sleep(2.0)
            drawn.append(min(page.scrub(3.0)))
            for label in ("Add at the person", "Undo"):
                page.script("window.__asked = performance.now();")
                page.press(label)
                page.until(lambda: page.script("return window.__clipAt > window.__asked"), "an answer")
                edits.append(page.script("return (window.__clipAt - window.__asked) / 1000"))
    print(f"usable {min(usable):.2f} s, drawn {max(drawn):.1f} Hz, edit {min(edits):.3f} s")
    if os.getloadavg()[0] > 1.5 * (os.cpu_count() or 1):
        pytest.skip(f"the machine is busy: usable {min(usable):.2f} s, drawn {max(drawn):.1f} Hz")
    assert min(usable) <= USABLE_S
    assert max(drawn) >= FRAMES_HZ
    assert min(edits) <= EDIT_S
