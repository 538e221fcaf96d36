"""`simrecon studio` before it serves: what it refuses. The studio itself is tested in tests/studio."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from simrecon import cli
from simrecon.studio import serving


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if the extra were there."""
    monkeypatch.setattr(serving, "check_installed", lambda: None)


def test_without_the_extra_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    assert cli.main(["studio"]) == 2
    assert "pip install '.[studio]'" in capsys.readouterr().err


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ["nothing.npz"],
            "nothing.npz: there is no such file; valid: a result, evidence, a video, or a batch",
        ),
        (["{folder}"], "holds no result; valid: a result folder, or one of a batch"),
        (["{folder}", "--fov", "40"], "holds no result"),
        (["--scene", "room.toml"], "found no PATH beside them; valid: name a result or evidence"),
        (["--port", "70000"], "valid: a whole number from 0 to 65535"),
    ],
)
def test_what_can_not_be_opened_is_one_line(
    words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["studio", *(word.format(folder=tmp_path) for word in words)]) == 2
    message = capsys.readouterr().err
    assert said in message
    assert message.count("\n") == 1
