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
