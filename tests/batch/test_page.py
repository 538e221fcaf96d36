"""The report, as text and in a browser without a window."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from simrecon import cli
from simrecon.batch import journal, page, records, status
from simrecon.batch.journal import Journal, Places
from simrecon.results import whole

FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
)  # fmt: skip
LOSSES = {"walk": 12.5, "sit": 3.0, "kick <b>": 101.0}


def figures(name: str, **changed: Any) -> dict[str, Any]:
    metrics = {"mpjpe_2d_px": 8.0, "footskate_pct": None, "penetration_mean_mm": 1.0, "mean_grf_pct_bw": 99.0}
    return {
        "verdict": "all simulated", "fell": False, "frames": 30, "fallback": 0, "video_s": 1.0, "wall_s": 7.5,
        "loss": LOSSES[name], "metrics": metrics, **changed,
    }  # fmt: skip


@pytest.fixture
def places(tmp_path: Path) -> Places:
    """A batch that is over: three results, one with fallback and one that fell, and a failure."""
    found = Places(tmp_path / "night")
    found.root.mkdir()
    book = Journal(found.events)
    book.append("begin")
    for name in (*LOSSES, "broken"):
        about = {"input": f"/in/{name}.npz", "plan": "quick", "video_s": 1.0, "windows": 3}
        book.append("clip", clip=name, state="waiting", **about)
    changed: dict[str, dict[str, Any]] = {"walk": {}, "sit": {"fell": True}, "kick <b>": {"fallback": 7}}
    for name, change in changed.items():
        journal.write_json(found.record(name), {"key": "k", "figures": figures(name, **change)})
        (found.result(name)).mkdir()
        (found.result(name) / "report.json").touch()
        found.thumbnail(name).parent.mkdir(exist_ok=True)
        picture = np.full((20, 40, 3), 128, np.uint8)
        found.thumbnail(name).write_bytes(cv2.imencode(".jpg", picture)[1].tobytes())
        book.append("done", clip=name)
    book.append("failed", clip="broken", message="can't <be> read")
    book.append("end")
    book.close()
    return found


def test_the_page_says_what_became_of_every_clip(places: Places) -> None:
    text = page.write(places).read_text(encoding="utf-8")
    rows = re.findall(r'<tr class="(\w+)">(.*?)</tr>', text)
    assert [kind for kind, _ in rows] == ["good", "fell", "fallback", "failed"]
    assert "7 of 30 frames on kinematic fallback" in rows[2][1]
    assert "can&#x27;t &lt;be&gt; read" in rows[3][1]
    assert 'href="walk/report.json"' in rows[0][1]
    assert 'href="kick%20%3Cb%3E/report.json"' in rows[2][1]
    assert "<b>" not in rows[2][1]
    assert [row.count("data:image/jpeg;base64,") for _, row in rows] == [1, 1, 1, 0]


def test_name_and_picture_lead_to_the_page_of_a_clip(places: Places) -> None:
    (places.result("walk") / "report.html").touch()
    text = page.write(places).read_text(encoding="utf-8")
    assert text.count('<a href="walk/report.html"><img') == 1
    assert text.count('<a class="name" href="walk/report.html">') == 1


def test_the_page_needs_nothing_else(places: Places) -> None:
    text = page.render(places, status.read(places))
    assert "http" not in text
    assert not re.search(r"<(script|link|img)[^>]+(src|href)=\"(?!data:)", text)
    assert "<!--" not in text


@pytest.fixture
def chromium(tmp_path: Path) -> list[str]:
    """The start of a command that prints a page as a browser has it after its scripts ran."""
    found = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if found is None:
        pytest.skip("needs Chromium")
    return [found, *FLAGS, f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom"]


@pytest.mark.parametrize(
    ("wanted", "order"),
    [
        ("", ["walk", "sit", "kick <b>", "broken"]),
        ("#sort=loss", ["sit", "walk", "kick <b>", "broken"]),
        ("#sort=-loss", ["kick <b>", "walk", "sit", "broken"]),
        ("#sort=clip", ["broken", "kick <b>", "sit", "walk"]),
        ("#sort=verdict", ["broken", "sit", "kick <b>", "walk"]),
        ("#sort=skate", ["walk", "sit", "kick <b>", "broken"]),
    ],
)
def test_a_browser_sorts_it(places: Places, chromium: list[str], wanted: str, order: list[str]) -> None:
    address = page.write(places).as_uri() + wanted
    shown = subprocess.run([*chromium, address], capture_output=True, text=True, timeout=120, check=True)
    titles = re.findall(r'title="/in/(.*?)\.npz"', shown.stdout)
    assert [title.replace("&lt;", "<").replace("&gt;", ">") for title in titles] == order
    assert ("aria-sort" in shown.stdout.split("</thead>")[0].split("<thead>")[1]) == bool(wanted)


def test_a_name_that_is_no_text_and_control_characters_are_escaped(places: Places) -> None:
    book = Journal(places.events)
    book.append("clip", clip="odd", state="waiting", input=os.fsdecode(b"/in/caf\xe9\x1b[2J<b>.npz"))
    book.close()
    text = page.write(places).read_text(encoding="utf-8")
    assert r"/in/caf\udce9\x1b[2J&lt;b&gt;.npz" in text


DAMAGED: dict[str, Any] = {
    "quality": "x", "loss": [], "verdict": 5, "fell": None, "frames": "1", "metrics": [], "wall_s": {},
}  # fmt: skip


@pytest.mark.parametrize("key", DAMAGED)
def test_a_record_of_other_types_is_damage_and_no_defect(
    places: Places, capsys: pytest.CaptureFixture[str], key: str
) -> None:
    said = figures("walk", **{key: DAMAGED[key]})
    journal.write_json(places.record("walk"), {"key": "k", "figures": said, "files": {}})
    assert records.read(places, "walk") is None
    for word, expected in (("status", 0), ("report", 0), ("verify", 1)):
        assert cli.main(["batch", word, str(places.root)]) == expected
    assert "walk: its record is damaged" in capsys.readouterr().out


@pytest.mark.skipif(os.name == "nt", reason="pipes of Unix")
def test_verify_believes_no_record_that_is_no_file_and_escapes_what_it_says(
    places: Places, capsys: pytest.CaptureFixture[str]
) -> None:
    needed = {name: {"bytes": "\x1b[2J", "sha256": ""} for name in whole.NEEDED}
    journal.write_json(places.record("walk"), {"key": "k", "figures": figures("walk"), "files": needed})
    for name in whole.NEEDED:
        (places.result("walk") / name).touch()
    places.record("sit").unlink()
    os.mkfifo(places.record("sit"))
    places.record("kick <b>").unlink()
    places.record("kick <b>").symlink_to("/dev/zero")
    assert cli.main(["batch", "verify", str(places.root)]) == 1
    said = capsys.readouterr().out
    assert said.count("its record is damaged") == 2
    assert "motion.npz has 0 bytes, and had '\\x1b[2J'" in said
    assert "0 of 3 results as written" in said
