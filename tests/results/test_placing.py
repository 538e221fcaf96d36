"""Nothing that is not ours is removed, whatever its name; what takes a place is on the disk before."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import Any

import pytest

from simrecon import results
from simrecon.drawing import overlay
from simrecon.errors import InputError
from simrecon.io import atomic
from simrecon.results import folder as folders
from simrecon.results import placing, whole
from tests.support.runs import job_of


def made(folder: Path, **files: str) -> Path:
    """A folder that looks like a result, and holds other files too."""
    folder.mkdir(parents=True)
    for name in (folders.MOTION, folders.MODEL):
        (folder / name).write_text(name, encoding="utf-8")
    atomic.write_json(folder / folders.REPORT, {"schema": folders.SCHEMA})
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_only_a_folder_with_our_mark_is_removed(tmp_path: Path) -> None:
    theirs, ours = tmp_path / ".walk.77.partial", tmp_path / ".run.77.partial"
    for folder in (theirs, ours):
        folder.mkdir()
        (folder / "file").touch()
    (ours / placing.MARK).touch()
    (tmp_path / ".link.partial").symlink_to(ours)
    placing.remove_unfinished(tmp_path / ".link.partial")
    placing.remove_unfinished(theirs)
    assert names(ours) == [placing.MARK, "file"]
    placing.remove_unfinished(ours)
    assert names(tmp_path) == [".link.partial", ".walk.77.partial"]


def test_a_folder_of_the_name_that_we_would_take_stays(tmp_path: Path) -> None:
    taken = tmp_path / f".out.{os.getpid()}.partial"
    taken.mkdir()
    (taken / "thesis.tex").touch()
    with placing.replacing(tmp_path / "out") as place:
        assert place.partial != taken
        (place.partial / folders.MOTION).touch()
    assert names(taken) == ["thesis.tex"]
    assert names(tmp_path / "out") == [folders.MOTION]


def test_what_is_left_of_a_killed_process_of_our_number_is_removed(tmp_path: Path) -> None:
    left = tmp_path / f".out.{os.getpid()}.partial"
    left.mkdir()
    for name in (placing.MARK, folders.MODEL):
        (left / name).touch()
    with placing.replacing(tmp_path / "out") as place:
        assert place.partial == left
        assert names(left) == [placing.MARK]
    assert names(tmp_path) == ["out"]


def test_a_file_that_comes_while_a_result_is_written_is_kept(tmp_path: Path) -> None:
    out = made(tmp_path / "out")
    with placing.replacing(out) as place:
        (out / "notes.txt").write_text("look at frame 5", encoding="utf-8")
        (place.partial / folders.MOTION).touch()
    assert place.kept == tmp_path / "out-earlier"
    assert (tmp_path / "out-earlier" / "notes.txt").read_text(encoding="utf-8") == "look at frame 5"
    assert names(out) == [folders.MOTION]


def test_what_a_killed_process_was_writing_into_a_result_goes_with_it(tmp_path: Path) -> None:
    """A picture, a page or an export, not a file that only looks like it."""
    out = made(tmp_path / "out")
    (out / folders.EXPORT).mkdir()
    for name in ("overlay.mp4", "report.html", "motion.bvh", "export/motion.glb"):
        with atomic.beside(out / name) as partial:
            partial.touch()
            left = partial.name
        (out / name).rename((out / name).with_name(left))
    folders.check_writable(out)
    with placing.replacing(out) as place:
        (place.partial / folders.MOTION).touch()
    assert names(out) == [folders.MOTION]
    assert names(tmp_path) == ["out"]
    for name in (".thesis.tex.7.7.partial.tex", ".motion.npz.partial", "motion.npz.7.7.partial.npz"):
        (out / name).touch()
        with pytest.raises(InputError, match="found a folder that holds"):
            folders.check_writable(out)
        (out / name).unlink()


def test_where_the_earlier_result_is_stands_in_the_report(run: Any, tmp_path: Path) -> None:
    out = tmp_path / "out"
    results.write(job_of(out), run)
    really_flush = atomic.flush_all

    def put(folder: Path) -> None:
        (out / "notes.txt").touch()
        really_flush(folder)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(atomic, "flush_all", put)
        said = results.write(job_of(out), run, overwrite=True).report
    assert said["earlier"] == str(tmp_path / "out-earlier")
    assert (tmp_path / "out-earlier" / "notes.txt").is_file()


@pytest.mark.parametrize("name", ["overlay.png", "motion.bvh"])
def test_a_folder_of_the_name_of_one_of_our_files_is_not_ours(tmp_path: Path, name: str) -> None:
    out = made(tmp_path / "out")
    (out / name).mkdir()
    (out / name / "thesis.tex").touch()
    assert not placing.discard(out)
    with pytest.raises(InputError, match=rf"holds {name}/; valid: a new or empty folder"):
        folders.check_writable(out)
    assert (out / name / "thesis.tex").is_file()


def test_a_result_is_discarded_and_another_folder_is_not(tmp_path: Path) -> None:
    assert placing.discard(made(tmp_path / "a"))
    assert not placing.discard(made(tmp_path / "b", notes="mine"))
    (tmp_path / "c").symlink_to(made(tmp_path / "d"))
    assert not placing.discard(tmp_path / "c")
    assert names(tmp_path) == ["b", "c", "d"]
    assert "notes" in names(tmp_path / "b")


def test_a_result_is_on_the_disk_before_it_is_in_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[str] = []
    really_sync, really_rename = os.fsync, Path.rename

    def sync(descriptor: int) -> None:
        folder = stat.S_ISDIR(os.fstat(descriptor).st_mode)
        marked = folder and placing.MARK in os.listdir(f"/proc/self/fd/{descriptor}")
        calls.append("marked folder" if marked else "folder" if folder else "file")
        really_sync(descriptor)

    def rename(source: Path, target: Path) -> Path:
        calls.append("rename")
        return really_rename(source, target)

    monkeypatch.setattr(os, "fsync", sync)
    monkeypatch.setattr(Path, "rename", rename)
    with placing.replacing(tmp_path / "out") as place:
        (place.partial / folders.MOTION).touch()
    assert calls == ["file", "file", "marked folder", "folder", "rename", "folder"]


@pytest.mark.parametrize("name", ["ü" * 127, "動" * 85, "a" * 255, os.fsdecode(b"caf\xe9")])
def test_any_name_that_a_folder_can_have(run: Any, tmp_path: Path, name: str) -> None:
    out = tmp_path / name
    written = results.write(job_of(out, input=os.fsdecode(b"caf\xe9.npz")), run)
    assert written.report["input"]["name"] == os.fsdecode(b"caf\xe9.npz")
    assert written.model.nu == run.problem.model.nu
    assert Path(written.job.output) == out
    assert written.job.input.endswith(os.fsdecode(b"caf\xe9.npz"))
    results.write(job_of(out), run, overwrite=True)
    assert names(tmp_path) == [name]


def test_an_overlay_for_any_name(run: Any, tmp_path: Path) -> None:
    out = tmp_path / os.fsdecode(b"caf\xe9")
    out.mkdir()
    assert overlay.write(out, results.open_result(write_into(out, run)).animation()).is_file()


def write_into(out: Path, run: Any) -> Path:
    results.write(job_of(out), run)
    return out


# --- whole


def test_a_result_is_whole_until_a_file_of_it_changes(tmp_path: Path) -> None:
    out = made(tmp_path / "out")
    (out / "overlay.png").write_bytes(b"picture")
    noted = whole.note(out)
    assert whole.damage(out, noted, hashes=True) == ""
    (out / "overlay.png").unlink()
    assert whole.damage(out, noted, hashes=True) == ""  # a picture may be removed
    (out / folders.MODEL).write_text("model.xmI", encoding="utf-8")
    assert whole.damage(out, noted) == ""
    assert whole.damage(out, noted, hashes=True) == "model.xml is not what was written"
    (out / folders.MOTION).write_text("mot", encoding="utf-8")
    assert whole.damage(out, noted) == "motion.npz has 3 bytes, and had 10"
    (out / folders.MOTION).unlink()
    assert whole.damage(out, noted) == "motion.npz is missing"


@pytest.mark.parametrize("said", [None, {}, [], {"motion.npz": 3}, {"../x": {"bytes": 1}}])
def test_what_is_noted_is_not_believed_blindly(tmp_path: Path, said: Any) -> None:
    out = made(tmp_path / "out")
    full = said if not said or not isinstance(said, dict) else {**whole.note(out), **said}
    assert "noted of its files" in whole.damage(out, full)
