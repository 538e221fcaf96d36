"""Files appear whole or not at all."""

from __future__ import annotations

import json
import os
import stat
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon.errors import InputError
from simrecon.io import atomic

WRITERS: dict[str, Callable[[Path], None]] = {
    "bytes": lambda path: atomic.write_bytes(path, b"new"),
    "durable": lambda path: atomic.write_bytes(path, b"new", durable=True),
    "text": lambda path: atomic.write_text(path, "new"),
    "json": lambda path: atomic.write_json(path, ["new"]),
    "npz": lambda path: atomic.write_npz(path, {"a": np.zeros(3)}),
}


@pytest.fixture
def target(tmp_path: Path) -> Path:
    """A file that is there already, alone in its folder."""
    path = tmp_path / "inside" / "file.json"
    path.parent.mkdir()
    path.write_bytes(b"old")
    return path


def no_space(*_: Any) -> None:
    raise OSError(28, "No space left on device")


def assert_as_before(target: Path) -> None:
    assert target.read_bytes() == b"old"
    assert [entry.name for entry in target.parent.iterdir()] == [target.name]


@pytest.mark.parametrize("writer", WRITERS)
def test_the_file_is_replaced_and_nothing_is_left_beside_it(target: Path, writer: str) -> None:
    WRITERS[writer](target)
    assert target.read_bytes() != b"old"
    assert [entry.name for entry in target.parent.iterdir()] == [target.name]


@pytest.mark.parametrize("writer", WRITERS)
def test_a_rename_that_fails_leaves_the_old_file(
    target: Path, writer: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "replace", no_space)
    with pytest.raises(OSError, match="No space left"):
        WRITERS[writer](target)
    assert_as_before(target)


def test_a_disk_that_fails_leaves_the_old_file(target: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "fsync", no_space)
    with pytest.raises(OSError, match="No space left"):
        atomic.write_bytes(target, b"new", durable=True)
    assert_as_before(target)


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_a_block_that_fails_leaves_the_old_file(target: Path, error: type[BaseException]) -> None:
    def fail() -> None:
        with atomic.beside(target) as partial:
            partial.write_bytes(b"half")
            assert partial.parent == target.parent
            assert partial.suffix == target.suffix
            assert target.read_bytes() == b"old"
            raise error

    with pytest.raises(error):
        fail()
    assert_as_before(target)


def test_a_durable_file_is_on_the_disk_before_its_name_and_the_folder_after(
    target: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[str] = []
    really_sync, really_replace = os.fsync, os.replace

    def sync(descriptor: int) -> None:
        calls.append("folder" if stat.S_ISDIR(os.fstat(descriptor).st_mode) else "file")
        really_sync(descriptor)

    def replace(source: Path, place: Path) -> None:
        assert Path(source).read_bytes() == b"new"
        calls.append("rename")
        really_replace(source, place)

    monkeypatch.setattr(os, "fsync", sync)
    monkeypatch.setattr(os, "replace", replace)
    atomic.write_bytes(target, b"new", durable=True)
    assert calls == ["file", "rename", *(["folder"] if os.name != "nt" else [])]
    calls.clear()
    atomic.write_bytes(target, b"new")
    assert calls == ["rename"]


def test_a_link_stays_one(target: Path) -> None:
    link = target.with_name("link.json")
    link.symlink_to(target.name)
    atomic.write_text(link, "new")
    assert link.is_symlink()
    assert target.read_text(encoding="utf-8") == "new"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
def test_a_pipe_is_not_replaced(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="not a regular file"):
        atomic.write_text(tmp_path / "pipe", "new")
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)


def test_a_folder_is_not_replaced(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="not a regular file"):
        atomic.write_text(tmp_path, "new")


def test_the_longest_name_that_a_folder_can_have(tmp_path: Path) -> None:
    atomic.write_text(tmp_path / ("n" * 251 + ".txt"), "new")
    assert [len(entry.name) for entry in tmp_path.iterdir()] == [255]


def test_threads_that_write_one_file_leave_one_of_their_texts(target: Path) -> None:
    texts = [str(i) * 100_000 for i in range(4)]

    def write(text: str) -> None:
        for _ in range(20):
            atomic.write_text(target, text)

    threads = [threading.Thread(target=write, args=(text,)) for text in texts]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert target.read_text(encoding="utf-8") in texts
    assert [entry.name for entry in target.parent.iterdir()] == [target.name]


def test_text_is_written_as_it_is(target: Path) -> None:
    atomic.write_text(target, "ü\n\r\n")
    assert target.read_bytes() == b"\xc3\xbc\n\r\n"


def test_json_is_valid(target: Path) -> None:
    atomic.write_json(target, {"a": [1.5, "ü"]})
    assert json.loads(target.read_bytes()) == {"a": [1.5, "ü"]}
    with pytest.raises(ValueError, match="not JSON compliant"):
        atomic.write_json(target, float("nan"))
    assert json.loads(target.read_bytes()) == {"a": [1.5, "ü"]}


def test_arrays_are_the_same_bytes_every_time_and_never_objects(target: Path) -> None:
    arrays = {"a": np.arange(3.0), "b": ["x", "y"], "c": 2.5}
    atomic.write_npz(target, arrays)
    assert target.read_bytes() == atomic.npz_bytes(arrays)
    with np.load(target, allow_pickle=False) as archive:
        assert archive["b"].tolist() == ["x", "y"]
    with pytest.raises(ValueError, match="allow_pickle"):
        atomic.npz_bytes({"a": np.array([{}], dtype=object)})


def test_what_can_not_be_written_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "none" / "file.txt"
    with pytest.raises(InputError) as caught, atomic.reported(path):
        atomic.write_text(path, "new")
    assert (
        str(caught.value) == f"{path}: cannot be written (No such file or directory); valid: a writable place"
    )
