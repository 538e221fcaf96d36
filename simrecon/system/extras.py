"""Packages that only some parts need: how they are loaded, and what is said where one is missing."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Mapping
from dataclasses import dataclass
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


@dataclass(frozen=True)
class Extra:
    """One extra of `setup.cfg`.

    Attributes:
        packages: as they are imported, and as they are installed.
        purpose: what it is for.
    """

    packages: Mapping[str, str]
    purpose: str

    def missing(self) -> tuple[str, ...]:
        """Packages that are not installed, by their names there."""
        return tuple(
            installed
            for imported, installed in self.packages.items()
            if importlib.util.find_spec(imported) is None
        )


EXTRAS = {
    "video": Extra({"ai_edge_litert": "ai-edge-litert"}, "videos as input"),
    "batch": Extra({"distributed": "distributed"}, "many clips: simrecon batch"),
    "studio": Extra({"viser": "viser"}, "scenes and contacts by hand: simrecon studio"),
    "plot": Extra({"matplotlib": "matplotlib", "pandas": "pandas"}, "curves and tables in Python"),
    "usd": Extra({"pxr": "usd-core"}, "simrecon export --to usd"),
    "centroidal": Extra({"casadi": "casadi"}, "the planner centroidal"),
    "mesh": Extra({"coacd": "coacd"}, "meshes of a scene in convex parts"),
}
"""What users may install besides; a test holds it against `setup.cfg`."""
