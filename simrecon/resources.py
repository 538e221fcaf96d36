"""The data files that ship with simrecon: found in a wheel, an editable install and a plain checkout."""

from __future__ import annotations

import importlib.resources
import tomllib
from pathlib import Path
from typing import Any

from simrecon.errors import SimreconError


def folder(name: str) -> Path:
    """Find a shipped folder, such as `models`, `windows` or `example`.

    A wheel carries `models` and `windows` inside the package; in a checkout they lie beside it.

    Args:
        name: of the folder, relative to the package or to the checkout.

    Returns:
        The folder.

    Raises:
        SimreconError: It is in neither place.
    """
    package = _package_folder()
    checkout = package.parent
    if (package / name).is_dir():
        return package / name
    # Beside an installed package lie other people's packages, not a checkout.
    if (checkout / "setup.cfg").is_file() and (checkout / name).is_dir():
        return checkout / name
    raise SimreconError(
        f"the folder {name!r} is neither in the package ({package / name}) nor in a checkout "
        f"({checkout / name}): install simrecon again"
    )


def toml(name: str, *parts: str) -> dict[str, Any]:
    """Read a shipped TOML file.

    Args:
        name: of the shipped folder, as in `folder`.
        *parts: path of the file in it, with its suffix: `toml("models", "body", "limits.toml")`.

    Returns:
        The file's tables.

    Raises:
        SimreconError: The folder or file is not there (the message lists those that are), or is not TOML.
    """
    path = folder(name).joinpath(*parts)
    try:
        with path.open("rb") as stream:
            return tomllib.load(stream)
    except OSError as error:
        there = ", ".join(sorted(found.name for found in path.parent.glob("*.toml"))) or "none"
        raise SimreconError(f"cannot read {path}; TOML files there: {there}") from error
    except ValueError as error:  # TOMLDecodeError and UnicodeDecodeError
        raise SimreconError(f"{path} is not valid TOML: {error}") from error


def _package_folder() -> Path:
    return Path(str(importlib.resources.files("simrecon")))
