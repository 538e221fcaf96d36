"""Paths that a user gives: what no file or folder can be called is refused before it is looked for."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

from simrecon.errors import InputError


def is_usable(path: str) -> bool:
    """Whether a text can name a file or folder: it is not blank, and holds no NUL."""
    return bool(path.strip()) and "\0" not in path


def usable(path: str | os.PathLike[str]) -> Path:
    """A path that can name a file or folder.

    Raises:
        InputError: it is blank, or holds a NUL.
    """
    text = os.fspath(path)
    if not is_usable(text):
        raise InputError(f"found the path {text!r}; valid: the name of a file or folder")
    return Path(path)


@contextlib.contextmanager
def plain(path: Path) -> Iterator[str]:
    """The whole path of a file, for a library that takes text alone.

    OpenCV ends the process over a name that is no UTF-8: a link in a temporary folder stands for it while the
    block lasts, whether the file is there or is to be written. A relative name such as `http:host` would be
    an address to FFmpeg.
    """
    whole = path.absolute()
    try:
        os.fspath(whole).encode()
    except UnicodeEncodeError:
        with tempfile.TemporaryDirectory(prefix="simrecon-") as folder:
            link = Path(folder) / f"file{path.suffix if path.suffix.isascii() else ''}"
            link.symlink_to(whole)
            yield str(link)
    else:
        yield str(whole)
