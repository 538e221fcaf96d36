"""Models: compiled from text or read from a file."""

from __future__ import annotations

from pathlib import Path

import mujoco

from simrecon.errors import InputError


def compile_text(mjcf: str) -> mujoco.MjModel:
    """The model of an MJCF text."""
    return mujoco.MjModel.from_xml_string(mjcf)


def load(path: Path | str) -> mujoco.MjModel:
    """Read a model file.

    Raises:
        InputError: it can't be loaded.
    """
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise InputError(f"{path}: cannot be loaded ({error}); valid: a result's model") from error
