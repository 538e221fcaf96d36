"""Paths that nothing can be called, given to whatever takes one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import simrecon
from simrecon import cli
from simrecon.errors import InputError
from simrecon.io import atomic, reading
from simrecon.io.paths import is_usable, usable

NO_NAMES = ("", "   ", "\t", "a\0b")


def evidence() -> simrecon.Evidence:
    return simrecon.evidence_from_arrays(
        np.arange(3) / 30, joint_names=("pelvis",), joints_m=np.zeros((3, 1, 3)), height_m=1.7
    )


CALLS: dict[str, Callable[[str], Any]] = {
    "read_evidence": simrecon.read_evidence,
    "suggest": simrecon.suggest,
    "write_evidence": lambda path: simrecon.write_evidence(path, evidence()),
    "read_plan": simrecon.read_plan,
    "read_scene": simrecon.read_scene,
    "read_contacts": simrecon.read_contacts,
    "open_result": simrecon.open_result,
    "evaluate": lambda path: simrecon.evaluate(path, "truth.npz"),
    "export": lambda path: simrecon.export(path, ["csv"]),
    "picture": lambda path: simrecon.picture(path, "a.png"),
    "rerun": lambda path: simrecon.rerun(path, "out"),
    "retarget": lambda path: simrecon.retarget(path, "out", simrecon.Person(height_m=1.8)),
    "synthesize": lambda path: simrecon.synthesize(path, "out"),
    "run": lambda path: simrecon.run(simrecon.Job(path, "out")),
    "run to": lambda path: simrecon.run(simrecon.Job("clip.npz", path)),
    "run_people": lambda path: simrecon.run_people(simrecon.Job(path, "out")),
    "camera": lambda path: simrecon.run(simrecon.Job("a", "out", reading=simrecon.Reading(camera=path))),
    "keypoints": lambda path: simrecon.run(simrecon.Job("a", "o", reading=simrecon.Reading(keypoints=path))),
    "body_model": lambda path: simrecon.run(simrecon.Job("a", "o", person=simrecon.Person(body_model=path))),
    "video": lambda path: simrecon.run(simrecon.Job("a", "out", video=path)),
    "detected": lambda path: simrecon.run(simrecon.Job("a", "out", detected=path)),
    "start": lambda path: simrecon.run(simrecon.Job("a", "out", start=path)),
}


@pytest.mark.parametrize("path", NO_NAMES)
@pytest.mark.parametrize("name", CALLS)
def test_a_call_refuses_it_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, path: str
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError) as error:
        CALLS[name](path)
    assert str(error.value).isprintable()
    assert list(tmp_path.iterdir()) == []


COMMANDS = (
    "run @ -o out", "run a -o @", "run --job @ -o out", "run a -o out --plan @", "run a -o out --scene @",
    "run a -o out --contacts @", "run a -o out --camera @", "run a -o out --keypoints @",
    "run a -o out --body-model @", "run a -o out --video @", "demo -o @", "look @", "look a -o @",
    "rerun @ -o out", "rerun a -o @", "rerun a -o out --input @", "retarget @ -o out", "retarget a -o @",
    "synthesize @ -o out", "synthesize a -o @", "report @", "export @ --to csv", "export a --to csv -o @",
    "eval @ a", "eval a @", "eval a b --input @", "eval a b -o @", "picture @", "picture a -o @",
    "scene new @", "scene check @", "scene add @ box", "scene show @", "scene show a -o @",
    "scene suggest @", "contacts show @", "contacts show a -o @", "bench @ --data a -o out",
    "bench planners --data @ -o out", "bench planners --data a -o @",
    "bench planners --data a -o b --write @",
    "batch @ -o out", "batch a -o @", "batch status @", "batch verify @", "batch report @", "studio @",
    "studio a --scene @", "studio a --video @",
)  # fmt: skip


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_refuses_it_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    monkeypatch.chdir(tmp_path)
    for path in NO_NAMES:
        status = cli.main([path if word == "@" else word for word in command.split()])
        said = capsys.readouterr().err
        assert (status, said.count("\n")) == (2, 1)
        assert said.startswith("simrecon: error: ")
        assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("path", [".", "..", "/"])
@pytest.mark.parametrize("command", ["look @", "picture @", "run @ -o out", "scene show @", "report @"])
def test_a_folder_without_a_name_is_no_defect(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    command: str,
    path: str,
) -> None:
    (tmp_path / "in").mkdir()
    monkeypatch.chdir(tmp_path / "in")
    assert cli.main(command.replace("@", path).split()) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_what_the_system_does_not_let_through_is_no_defect(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for error in (
        PermissionError(13, "Permission denied", "/proc/1/cwd"),
        FileNotFoundError(2, "No such file"),
    ):

        def fail(_: Any, error: OSError = error) -> None:
            raise error

        monkeypatch.setattr("simrecon.evidence.content.containers.kind", lambda *_: fail(_))
        assert cli.main(["look", __file__]) == 2
        assert "valid: a path that can be followed" in capsys.readouterr().err


def test_files_are_neither_read_nor_written_under_it(tmp_path: Path) -> None:
    for path in NO_NAMES:
        assert not is_usable(path)
        with pytest.raises(InputError):
            usable(path)
        with pytest.raises(FileNotFoundError):
            reading.read_bytes(path)
        with pytest.raises(OSError, match=r"No such file|not a regular file"):
            atomic.write_bytes(path, b"")
    assert usable(tmp_path / " a") == tmp_path / " a"
