"""Paths that the system can't follow are the user's, in one line."""

from __future__ import annotations

from pathlib import Path

import pytest

from simrecon import cli
from tests.support.corpus import CASES

CLIP = str(CASES / "trc_keypoint_names.trc")


@pytest.mark.parametrize("words", [["report", "PATH"], ["run", CLIP, "-o", "PATH"]])
@pytest.mark.parametrize("kind", ["long", "circle"])
def test_a_path_that_leads_nowhere_is_a_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], kind: str
) -> None:
    path = tmp_path / ("x" * 5000 if kind == "long" else "circle")
    if kind == "circle":
        path.symlink_to(path)
    assert cli.main([str(path) if word == "PATH" else word for word in words]) == 2
    said = capsys.readouterr().err
    assert said.startswith("simrecon: error: ")
    assert said.count("\n") == 1
    assert "--debug" not in said
    assert len(said) < 3100


def test_a_result_does_not_replace_the_folder_one_is_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.main(["run", CLIP, "-o", "."]) == 2
    assert "the folder that this runs in" in capsys.readouterr().err
    assert Path.cwd() == tmp_path
