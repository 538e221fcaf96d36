"""Paths that a user gives: what no file or folder can be called is refused before it is looked for."""

from __future__ import annotations

import os
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
