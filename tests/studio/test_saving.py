"""Where the studio can't write: one line, and nothing is lost."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from simrecon.errors import InputError
from simrecon.results import Result
from simrecon.studio import keeping, saving
from simrecon.studio.asking import Wanted
from simrecon.studio.tab import Tab
from simrecon.types import ContactWish

SAVE: dict[str, Callable[[Tab, Path], None]] = {
    "scene": saving.scene,
    "contacts": saving.contacts,
    "job": lambda tab, path: saving.job(tab, path, Wanted()),
}


def files(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def edited(tab: Tab) -> Tab:
    tab.document.add("chair", (2.0, 0.0, 0.0))
    tab.document.wish((ContactWish("left_heel", touch=((0.0, 0.1),)),), "painted")
    return tab


def full(monkeypatch: pytest.MonkeyPatch, code: int = errno.ENOSPC) -> None:
    """Each file that is written aside is too much."""
    opened = Path.open

    def open_(self: Path, mode: str = "r", *rest: Any, **more: Any) -> Any:
        if set(mode) & set("wax"):
            raise OSError(code, os.strerror(code), str(self))
        return opened(self, mode, *rest, **more)

    monkeypatch.setattr(Path, "open", open_)


@pytest.mark.parametrize("what", SAVE)
def test_what_cannot_be_written_is_one_line_and_stays_unsaved(
    tab: Tab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    edited(tab)
    before = files(tmp_path)
    for code in (errno.ENOSPC, errno.EROFS, errno.EACCES, errno.EIO):
        with monkeypatch.context() as patch:
            full(patch, code)
            with pytest.raises(InputError, match=r"new\.toml: cannot be written") as error:
                SAVE[what](tab, tmp_path / "new.toml")
        assert "\n" not in str(error.value)
        assert tab.document.unsaved
        assert files(tmp_path) == before
    SAVE[what](tab, tmp_path / "new.toml")
    assert (tmp_path / "new.toml").is_file()


NO_NAMES = {
    "a NUL": "a\0b.toml",
    "too long": "x" * 300 + ".toml",
    "a folder": "folder.toml",
    "a folder that is missing": "nowhere/new.toml",
    "a circle": "circle.toml",
    "a file as a folder": "file/new.toml",
    "a pipe": "pipe.toml",
}
ODD_NAMES = ("a\nb.toml", "\x1b[2J.toml", "\u2028.toml", os.fsdecode(b"\xff.toml"), " .toml")


@pytest.mark.skipif(os.name == "nt", reason="names and pipes of Unix")
def test_a_name_that_no_file_can_have_is_one_line(tab: Tab, tmp_path: Path) -> None:
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "file").write_text("mine")
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "circle.toml").symlink_to("circle.toml")
    edited(tab)
    before = files(tmp_path)
    for save in SAVE.values():
        for name in NO_NAMES.values():
            with pytest.raises(InputError) as error:
                save(tab, tmp_path / name)
            assert "\n" not in str(error.value)
    assert tab.document.unsaved
    assert files(tmp_path) == before


@pytest.mark.skipif(os.name == "nt", reason="names of Unix")
def test_an_odd_name_is_written(tab: Tab, tmp_path: Path) -> None:
    for what, save in SAVE.items():
        for name in ODD_NAMES:
            (tmp_path / what).mkdir(exist_ok=True)
            save(edited(tab), tmp_path / what / name)
            assert (tmp_path / what / name).read_bytes()
            with pytest.raises(InputError, match="exists already") as error:
                save(tab, tmp_path / what / name)
            assert str(error.value).isprintable()


def test_a_result_that_is_not_copied_whole_is_not_there(
    squat: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def copyfile(_: Path, target: Path) -> None:
        Path(target).write_bytes(b"half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(target))

    before = files(tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr(keeping.shutil, "copyfile", copyfile)  # type: ignore[attr-defined]
        with pytest.raises(InputError, match="cannot be written"):
            keeping.result(squat, tmp_path / "kept")
    assert files(tmp_path) == before
    assert keeping.result(squat, tmp_path / "kept").motion is not None


def test_an_edit_that_the_disk_does_not_take_is_made_and_told(
    tab: Tab, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        full(patch)
        tab.document.add("chair", (2.0, 0.0, 0.0))
    assert "cannot be written" in tab.failure
    assert tab.document.scene.items
    assert tab.document.unsaved
