"""Models: compiled from text or read from a file."""

from __future__ import annotations

import re
from pathlib import Path

import mujoco
import numpy as np

from simrecon.errors import InputError
from simrecon.io.limits import NUMBER_MAX
from simrecon.io.reading import read_text

_OTHER_FILE = re.compile(r"<include\b[^>]*|\b(?:file|\w+dir|plugin)\s*=\s*[\"'][^\"']*")
"""What in a model asks MuJoCo for a file, or for a library that it would load."""
ELEMENTS = frozenset(
    (
        "mujoco", "compiler", "option", "flag", "default", "statistic", "asset", "mesh", "hfield",
        "worldbody", "body", "frame", "freejoint", "joint", "geom", "site", "contact", "exclude", "pair",
        "actuator", "general", "position", "motor", "tendon", "fixed", "equality", "connect", "weld",
    )
)  # fmt: skip
"""Of the models of results. None makes more of itself than stands in the file, as `replicate` does."""
_NAME = re.compile(r"<([^\s<>/!?]+)")
_GROWS = re.compile(r"\bbuiltin\s*=|<hfield\b(?![^>]*\belevation\s*=)[^>]*")
"""Meshes and height fields of a size that is only claimed."""


def compile_text(mjcf: str) -> mujoco.MjModel:
    """The model of an MJCF text."""
    return mujoco.MjModel.from_xml_string(mjcf)


def load(path: Path | str) -> mujoco.MjModel:
    """Read a model file that needs no other file.

    Raises:
        InputError: it can't be loaded, or names another file.
    """
    return compile_foreign(text_of(path), f"{path}")


def compile_foreign(text: str, where: str) -> mujoco.MjModel:
    """The model of a text out of a file, which `where` names in messages.

    Raises:
        InputError: as `load`.
    """
    check(text, where)
    try:
        model = compile_text(text)
    except (ValueError, RuntimeError, mujoco.FatalError, mujoco.UnexpectedError) as error:
        why = " ".join(f"{error}".split())
        raise InputError(f"{where}: cannot be loaded ({why}); valid: a result's model") from error
    if (odd := _senseless(model)) is not None:
        why = f"{odd} holds a number beyond {NUMBER_MAX:g}"
        raise InputError(f"{where}: cannot be loaded ({why}); valid: a result's model")
    return model


def _senseless(model: mujoco.MjModel) -> str | None:
    """An array of a model with a number that is none or too large; what MuJoCo divides by is passed over."""
    for name in dir(model):
        values = None if name.startswith("_") or "invweight" in name else getattr(model, name)
        if not isinstance(values, np.ndarray) or values.dtype.kind != "f" or not values.size:
            continue
        if not np.abs(values).max() <= NUMBER_MAX:  # NaN, too
            return name
    return None


def check(text: str, where: str) -> None:
    """Refuse a model that no result has: one that names another file, or grows when it is compiled.

    Raises:
        InputError: it is one.
    """
    odd = next((name for name in _NAME.findall(text) if name not in ELEMENTS), None)
    if (named := _OTHER_FILE.search(text)) is not None:
        why = f"it names another file: {named[0][:80]}"
    elif odd is not None:
        why = f"it has an element {odd[:80]!r}, which no result has"
    elif (grown := _GROWS.search(text)) is not None:
        why = f"it claims more than it holds: {grown[0][:80]}"
    else:
        return
    raise InputError(f"{where}: cannot be loaded ({why}); valid: a result's model")


def text_of(path: Path | str) -> str:
    """The text of a model file that needs no other file.

    Raises:
        InputError: it can't be read, or names another file.
    """
    try:
        text = read_text(path)
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot be loaded ({why}); valid: a result's model") from error
    check(text, f"{path}")
    return text
