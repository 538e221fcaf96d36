"""`simrecon doctor`: what is said of what is there, and of what is not."""

from __future__ import annotations

import configparser
import importlib.util
import shutil
import tempfile
import webbrowser
from collections import namedtuple
from pathlib import Path
from typing import Any

import pytest

from simrecon import cli
from simrecon.cli import doctor
from simrecon.evidence.video import weights
from simrecon.system import extras
from tools import CHECKOUT

NOT_FOR_USERS = {"train", "test", "dev", "docs"}
Usage = namedtuple("Usage", "total used free")


def said(capsys: pytest.CaptureFixture[str]) -> dict[str, tuple[str, str]]:
    lines = [line for line in capsys.readouterr().out.splitlines() if line]
    return {line[:20].strip(): (line[21:29].strip(), line[30:]) for line in lines[:-1]}


def test_the_extras_are_those_of_the_package() -> None:
    setup = configparser.ConfigParser()
    setup.read(CHECKOUT / "setup.cfg", encoding="utf-8")
    section = setup["options.extras_require"]
    assert set(extras.EXTRAS) == set(section) - NOT_FOR_USERS
    for name, extra in extras.EXTRAS.items():
        wanted = {line.split(">")[0].split("=")[0] for line in section[name].split("\n") if line}
        assert set(extra.packages.values()) == wanted, name


def test_what_is_missing_has_a_line_to_type(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    there = importlib.util.find_spec
    missing = {"pxr", "pandas"}
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name in missing else there(name))
    monkeypatch.setenv("SIMRECON_CACHE", str(tmp_path / "cache"))
    assert cli.main(["doctor", str(tmp_path)]) == 0
    found = said(capsys)
    state, text = found["extra usd"]
    assert state == "missing"
    assert text == f"simrecon export --to usd (usd-core): {extras.how('usd')}"
    assert "(pandas)" in found["extra plot"][1]
    assert found["weights detector"] == ("missing", "finds people, for videos: simrecon models fetch")
    assert found["weights lite"][1].endswith("simrecon models fetch lite")
    assert found["mujoco"][0] == found["cores"][0] == found["results"][0] == "there"
    assert {"OpenGL", "browser", "memory", "system", "python"} <= set(found)
    assert not (tmp_path / "cache").exists()  # nothing is made


def test_where_nothing_can_be_written_it_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(**_: Any) -> Any:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(tempfile, "TemporaryFile", refuse)
    assert cli.main(["doctor", str(tmp_path / "new")]) == 1
    shown = capsys.readouterr().out
    assert "FAILS" in shown
    assert "cannot be written (Permission denied)" in shown
    assert "before this is put right: results" in shown


def test_a_full_disk_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(1, 1, 1 << 20))
    assert cli.main(["doctor", str(tmp_path)]) == 1
    assert said(capsys)["results"] == (
        "FAILS",
        f"{tmp_path}: can be written, 0.0 GiB free; make room for 1 GiB",
    )


def test_damaged_weights_are_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(weights, "state", lambda _: "damaged")
    assert cli.main(["doctor", str(tmp_path)]) == 1
    assert said(capsys)["weights heavy"][1].endswith("simrecon models fetch --force")


def test_a_machine_without_browser(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: Any) -> Any:
        raise webbrowser.Error("could not locate runnable browser")

    monkeypatch.setattr(webbrowser, "get", none)
    monkeypatch.setattr(shutil, "which", lambda _: None)
    found = {about: (state, text) for about, state, text in doctor._desktop()}
    assert found["browser"][0] == "missing"
    monkeypatch.setattr(shutil, "which", lambda name: name if name == "firefox" else None)
    found = {about: (state, text) for about, state, text in doctor._desktop()}
    assert found["browser"][0] == "there"
    assert found["browser"][1].startswith("firefox, but no screen")
