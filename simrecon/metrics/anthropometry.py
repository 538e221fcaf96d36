"""What joints say of the body around them: stature and centre of mass (`models/body/centre_of_mass.toml`).

Axes: T frames, K joints; leading axes are batches.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from simrecon import resources
from simrecon.types import Array


@cache
def _data() -> dict[str, Any]:
    return resources.toml("models", "body", "centre_of_mass.toml")


def entries(kind: str) -> list[dict[str, Any]]:
    """Entries of a kind (`segment`, `capsule`) by both sides: those of the left stand for the right too."""
    return [side for entry in _data()[kind] for side in _sides(entry)]


def stature_m(names: Sequence[str], joints_m: Array) -> float:
    """Stature from the median length of thigh and shank (Winter 2009, fig. 4.1).

    Args:
        names: K names with hips, knees and ankles.
        joints_m: (T, K, 3).
    """
    at = {name: joints_m[:, k] for k, name in enumerate(names)}
    lengths = [
        np.median(np.linalg.norm(at[f"{side}_{a}"] - at[f"{side}_{b}"], axis=-1))
        for side in ("left", "right")
        for a, b in (("hip", "knee"), ("knee", "ankle"))
    ]
    return float(np.sum(lengths) / 2 / _data()["stature"]["leg"])


def centre_of_mass(names: Sequence[str], joints_m: Array) -> Array:
    """Centre of mass from the body's 12 joints, (..., K, 3) → (..., 3).

    Segment masses and centres of de Leva 1996 (`models/body/mass.toml`, `centre_of_mass.toml`).
    """
    at = {name: joints_m[..., k, :] for k, name in enumerate(names)}
    percent = resources.toml("models", "body", "mass.toml")["percent"]
    total, moment = 0.0, np.zeros((*joints_m.shape[:-2], 3))
    for entry in entries("segment"):
        mass = sum(percent[part] for part in entry["mass"])
        start, end = (np.mean([at[joint] for joint in entry[key]], axis=0) for key in ("from", "to"))
        moment += mass * (start + entry["at"] * (end - start))
        total += mass
    return np.asarray(moment / total)


def _sides(entry: dict[str, Any]) -> list[dict[str, Any]]:
    """An entry and, where its name starts with `left_`, that of the other side."""
    if not entry["name"].startswith("left_"):
        return [entry]
    other = {"name": entry["name"].replace("left_", "right_", 1)}
    other |= {key: [joint.replace("left_", "right_", 1) for joint in entry[key]] for key in ("from", "to")}
    return [entry, entry | other]
