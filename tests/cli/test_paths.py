"""Paths that the system can't follow are the user's, in one line; names are shown with escapes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import cli, results
from simrecon.metrics.truth import TRUTH_SCHEMA
from tests.support.corpus import CASES
from tests.support.runs import job_of

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


def test_names_reach_the_terminal_with_escapes(
    run: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = tmp_path / "red\x1b[31m"
    room, truth, out = place / "room.toml", place / "truth.npz", place / "out"
    motion = results.write(job_of(out), run).motion
    np.savez(
        truth,
        schema=TRUTH_SCHEMA,
        times_s=motion.times_s,
        joint_names=motion.joint_names,
        joints_m=motion.joints_m,
        peer_names=["\x1b]0;title\x07"],
        peer_joints_m=motion.joints_m[None],
    )
    for words in (
        ["scene", "new", str(room)],
        ["scene", "show", str(room)],
        ["contacts", "show", str(out), "-o", str(place / "contacts.toml")],
        ["picture", str(out), "--at", "lowest"],
        ["report", str(out)],
        ["eval", str(out), str(truth)],
    ):
        assert cli.main(words) == 0
        said = "".join(capsys.readouterr())
        assert "\x1b" not in said, words
        assert "\\x1b" in said or words[1] == "new", words
