"""Mass of a person and of its parts (`models/body/mass.toml`)."""

from __future__ import annotations

from functools import cache
from typing import Any

from simrecon import resources


@cache
def _data() -> dict[str, Any]:
    return resources.toml("models", "body", "mass.toml")


def density_kgpm3() -> float:
    """Of the whole body, air in the lungs included."""
    return float(_data()["whole"]["density_kgpm3"])
