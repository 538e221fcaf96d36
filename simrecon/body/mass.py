"""Mass of a person, and how it is shared out over the primitives (`models/body/mass.toml`).

Without a shape every segment has de Leva's share (1996). With a shape, shares follow its volumes:

    m_s = M p_s v_s / Σ p v,    v_s = (V_s / V) / (V_s / V)_mean

with de Leva's percentages p and the volumes V of the primitives of segment s; the mean shape has de Leva's
shares, and a broad trunk weighs more than a slender one. Within a segment mass follows volume. MuJoCo takes
each primitive's inertia from its mass and volume.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from simrecon import resources
from simrecon.errors import InputError
from simrecon.types import Array

DIGITS = 6
"""Significant digits of numbers in MJCF that MuJoCo writes."""


@dataclass(frozen=True)
class Distribution:
    """How mass is spread over a body (Rempe 2020, appendix E.6).

    Attributes:
        name: in `models/body/mass.toml`.
        mass_kg: of the character that it describes.
        segments: that together have `share` of the mass; empty: the usual distribution.
        share: of the whole mass, 0 to 1.
    """

    name: str
    mass_kg: float
    segments: tuple[str, ...]
    share: float


@cache
def data() -> dict[str, Any]:
    """The tables of `models/body/mass.toml`."""
    return resources.toml("models", "body", "mass.toml")


def density_kgpm3() -> float:
    """Of the whole body, air in the lungs included."""
    return float(data()["whole"]["density_kgpm3"])


@cache
def distributions() -> dict[str, Distribution]:
    """The distributions of mass that ship with simrecon, by name."""
    return {
        name: Distribution(name, entry["mass_kg"], tuple(entry["segments"]), entry["share"])
        for name, entry in data()["distribution"].items()
    }


def distribution(name: str) -> Distribution:
    """A distribution of mass by its name.

    Raises:
        InputError: there is none of that name.
    """
    if name not in distributions():
        raise InputError(f"mass distribution: found {name!r}; valid: {', '.join(distributions())}")
    return distributions()[name]


def volumes_m3(kinds: Sequence[str], values: Array) -> Array:
    """Volume of primitives (E,) from their values (E, 9), see `sizes.VALUES`."""
    length = np.linalg.norm(values[:, 3:6] - values[:, :3], axis=1)
    capsule = np.pi * values[:, 6] ** 2 * (length + 4.0 / 3.0 * values[:, 6])
    is_capsule = np.array([kind == "capsule" for kind in kinds])
    return np.asarray(np.where(is_capsule, capsule, 8.0 * values[:, 6:].prod(axis=1)))


def shaped(parts: Sequence[str], volumes: Array, mean_volumes: Array) -> Array:
    """Share of the mass of each primitive (P,) of a shape, sum 1; see the module.

    Args:
        parts: (P,) which part of de Leva's table each primitive is of.
        volumes: (P,) of the shape.
        mean_volumes: (P,) of the mean shape.
    """
    names = list(dict.fromkeys(parts))
    at = np.array([names.index(part) for part in parts])
    percent = np.array([data()["percent"][part] for part in names])
    of_part = np.bincount(at, volumes)  # limbs: both sides
    sides = np.array([1.0 if part in ("head_neck",) or part.endswith("trunk") else 2.0 for part in names])
    relative = of_part / volumes.sum() / (np.bincount(at, mean_volumes) / mean_volumes.sum())
    share = percent * sides * relative
    return np.asarray((share / share.sum())[at] * volumes / of_part[at])


def spread(shares: Array, segments: Sequence[str], distribution: Distribution) -> Array:
    """Shares (P,) changed so that the distribution's segments have its share, sum 1."""
    if not distribution.segments:
        return np.asarray(shares / shares.sum())
    inside = np.isin(segments, distribution.segments)
    factor = np.where(
        inside, distribution.share / shares[inside].sum(), (1 - distribution.share) / shares[~inside].sum()
    )
    return np.asarray(shares * factor)


def printable(masses_kg: Mapping[str, float], total_kg: float) -> dict[str, float]:
    """Masses that MJCF's six digits hold exactly and whose sum is the total, to 1e-6 kg.

    What rounding leaves is put on the two lightest primitives of the centre, then on the lightest pair of
    left and right, which have the most decimals.
    """
    rounded = {name: _rounded(mass) for name, mass in masses_kg.items()}
    lightest = sorted(rounded, key=lambda name: rounded[name])
    centre = [name for name in lightest if not name.startswith(("left_", "right_"))]
    for name in reversed(centre[:2]):
        rounded[name] = _rounded(rounded[name] + total_kg - math.fsum(rounded.values()))
    left = next(name for name in lightest if name.startswith("left_"))
    share = _rounded(rounded[left] + 0.5 * (total_kg - math.fsum(rounded.values())))
    return rounded | {left: share, left.replace("left_", "right_", 1): share}


def _rounded(mass_kg: float) -> float:
    return float(f"{mass_kg:.{DIGITS}g}")
