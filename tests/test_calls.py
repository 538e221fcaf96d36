"""Plain calls beside `run`: what they refuse."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import simrecon
from simrecon import evidence, results
from simrecon.errors import InputError
from simrecon.job import request
from tests.support.runs import job_of


@pytest.fixture
def folder(run: Any, tmp_path: Path) -> Path:
    evidence.write(tmp_path / "clip.npz", run.evidence)
    job = job_of(tmp_path / "out", input=str(tmp_path / "clip.npz"))
    results.write(replace(job, sha256=request.hashes(job)), run)
    return tmp_path / "out"


def test_unknown_fields_are_refused(folder: Path) -> None:
    with pytest.raises(InputError, match="rerun: found the field 'sed', did you mean 'seed'"):
        simrecon.rerun(folder, folder.parent / "new", sed=1)
    with pytest.raises(InputError, match="rerun: found the field 'start'; valid: input, reading"):
        simrecon.rerun(folder, folder.parent / "new", start="x.npz")
    with pytest.raises(InputError, match="retarget: found no other body"):
        simrecon.retarget(folder, folder.parent / "new", simrecon.Person())
    assert not (folder.parent / "new").exists()


def test_a_result_that_is_none_is_one_line(tmp_path: Path) -> None:
    missing, new = tmp_path / "none", tmp_path / "new.png"
    calls: list[Callable[[], Any]] = [
        lambda: simrecon.rerun(missing, new),
        lambda: simrecon.export(missing, ["bvh"]),
        lambda: simrecon.picture(missing, new),
    ]
    for call in calls:
        with pytest.raises(InputError, match="no such folder"):
            call()


def test_a_changed_input_is_refused_unless_it_is_said(folder: Path) -> None:
    clip = folder.parent / "clip.npz"
    clip.write_bytes(clip.read_bytes() + b"\0")
    with pytest.raises(InputError, match="its sha256 is not the one"):
        simrecon.rerun(folder, folder.parent / "new")
