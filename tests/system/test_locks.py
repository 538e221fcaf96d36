"""Locks of files, with the calls of this system and with those of Windows."""

from __future__ import annotations

import errno
import os
import sys
from pathlib import Path
from types import ModuleType

import pytest

from simrecon.system import locks


class Msvcrt(ModuleType):
    """Windows' locks of byte ranges: exclusive, given back when the file is closed."""

    LK_NBLCK = 2

    def __init__(self) -> None:
        super().__init__("msvcrt")
        self.held: dict[tuple[int, int], int] = {}

    def locking(self, descriptor: int, mode: int, count: int) -> None:
        assert (mode, count) == (self.LK_NBLCK, 1)
        place = os.fstat(descriptor).st_ino, os.lseek(descriptor, 0, os.SEEK_CUR)
        holder = self.held.get(place)
        if holder not in (None, descriptor) and Path(f"/dev/fd/{holder}").exists():
            raise PermissionError(errno.EACCES, "Permission denied")
        self.held[place] = descriptor


@pytest.fixture
def windows(monkeypatch: pytest.MonkeyPatch) -> Msvcrt:
    """A system without fcntl."""
    module = Msvcrt()
    monkeypatch.setitem(sys.modules, "fcntl", None)
    monkeypatch.setitem(sys.modules, "msvcrt", module)
    return module


@pytest.fixture(params=["this system", "windows"])
def path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    if request.param == "windows":
        request.getfixturevalue("windows")
    target = tmp_path / "lock"
    target.write_text("content", encoding="utf-8")
    return target


def test_one_holds_it_until_the_file_is_closed(path: Path) -> None:
    with path.open("a+") as first, path.open("a+") as second:
        assert locks.acquire(first)
        assert not locks.acquire(second)
        assert not locks.acquire(second, shared=True)
    with path.open("a+") as third:
        assert locks.acquire(third)


def test_the_content_can_be_read_and_written_meanwhile(path: Path) -> None:
    with path.open("a+", encoding="utf-8") as stream:
        assert locks.acquire(stream)
        assert path.read_text(encoding="utf-8") == "content"
        stream.truncate(0)
        stream.write("other")
        stream.flush()
        assert path.read_text(encoding="utf-8") == "other"


def test_shared_locks_stand_beside_each_other(tmp_path: Path) -> None:
    target = tmp_path / "lock"
    target.touch()
    with target.open() as first, target.open() as second, target.open("a") as third:
        assert locks.acquire(first, shared=True)
        assert locks.acquire(second, shared=True)
        assert not locks.acquire(third)


def test_windows_locks_a_byte_behind_any_content(windows: Msvcrt, tmp_path: Path) -> None:
    with (tmp_path / "lock").open("w+", encoding="utf-8") as stream:
        stream.write("content")
        stream.flush()
        assert locks.acquire(stream)
        assert stream.tell() == len("content")
    assert all(offset >= 2**30 for _, offset in windows.held)


def test_what_is_no_refusal_is_an_error(windows: Msvcrt, tmp_path: Path) -> None:
    def broken(*_: int) -> None:
        raise OSError(errno.EIO, "broken")

    windows.locking = broken  # type: ignore[method-assign]
    with (tmp_path / "lock").open("w") as stream, pytest.raises(OSError, match="broken"):
        locks.acquire(stream)
