"""Packages that only some parts need: how they are loaded, and what is said where one is missing."""

from __future__ import annotations

import importlib
from types import ModuleType

from simrecon.errors import InputError


def load(package: str, extra: str, who: str) -> ModuleType:
    """A package of one of simrecon's extras.

    Args:
        package: as it is imported.
        extra: of `setup.cfg`.
        who: what needs it; the message begins with it.

    Raises:
        InputError: it is not installed.
    """
    try:
        return importlib.import_module(package)
    except ImportError as error:
        raise InputError(f"{who} needs {package}: {how(extra)}") from error


def how(extra: str) -> str:
    """The command that installs an extra."""
    return f"python -m pip install '.[{extra}]' in simrecon's source folder"
