"""Models: compiled from text or read from a file."""

from __future__ import annotations

import re
from pathlib import Path

import mujoco

from simrecon.errors import InputError
from simrecon.io.reading import read_text

_OTHER_FILE = re.compile(r"<include\b[^>]*|\b(?:file|\w+dir|plugin)\s*=\s*[\"'][^\"']*")
"""What in a model asks MuJoCo for a file, or for a library that it would load."""


def compile_text(mjcf: str) -> mujoco.MjModel:
    """The model of an MJCF text."""
    return mujoco.MjModel.from_xml_string(mjcf)


def load(path: Path | str) -> mujoco.MjModel:
    """Read a model file that needs no other file.

    Raises:
        InputError: it can't be loaded, or names another file.
    """
    text = text_of(path)
    try:
        return compile_text(text)
    except (ValueError, mujoco.FatalError, mujoco.UnexpectedError) as error:
        why = " ".join(f"{error}".split())
        raise InputError(f"{path}: cannot be loaded ({why}); valid: a result's model") from error


def text_of(path: Path | str) -> str:
    """The text of a model file that needs no other file.

    Raises:
        InputError: it can't be read, or names another file.
    """
    try:
        text = read_text(path)
        if (named := _OTHER_FILE.search(text)) is not None:
            raise ValueError(f"it names another file: {named[0][:80]}")
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot be loaded ({why}); valid: a result's model") from error
    return text
