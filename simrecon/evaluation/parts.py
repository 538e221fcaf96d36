"""Parts of the body by which contact is compared, as capsules of joints and as primitives of a model.

Axes: T frames, C capsules or primitives, P parts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simrecon.types import Flags

_OF_MIDDLE = {
    "pelvis": ("pelvis", "left_buttock", "right_buttock"),
    "trunk": ("abdomen", "waist", "ribs", "thorax", "left_clavicle", "right_clavicle"),
}
_OF_SIDE = {
    "thigh": ("thigh",),
    "shank": ("calf", "shin"),
    "upper_arm": ("upper_arm",),
    "forearm": ("forearm", "hand"),
    "foot": ("foot",),
}
PRIMITIVES: dict[str, tuple[str, ...]] = _OF_MIDDLE | {
    f"{side}_{part}": tuple(f"{side}_{name}" for name in names)
    for part, names in _OF_SIDE.items()
    for side in ("left", "right")
}
"""Primitives by part, for all parts that `metrics.bones` puts capsules or points on."""


def known(capsules: Sequence[str]) -> tuple[str, ...]:
    """Parts that have one of these capsules."""
    return tuple(part for part in PRIMITIVES if any(name in capsules for name in _capsules(part)))


def of_capsules(flags: Flags, capsules: Sequence[str], parts: Sequence[str]) -> Flags:
    """Which parts have a capsule that is flagged, (T, C) → (T, P)."""
    return _any(flags, capsules, [_capsules(part) for part in parts])


def of_primitives(flags: Flags, primitives: Sequence[str], parts: Sequence[str]) -> Flags:
    """Which parts have a primitive that is flagged, (T, C) → (T, P)."""
    return _any(flags, primitives, [PRIMITIVES[part] for part in parts])


def _capsules(part: str) -> tuple[str, ...]:
    """The capsule of a part; the points of a foot."""
    side, _, name = part.partition("_")
    return (f"{side}_heel", f"{side}_toe") if name == "foot" else (part,)


def _any(flags: Flags, names: Sequence[str], groups: Sequence[Sequence[str]]) -> Flags:
    columns = [[names.index(name) for name in group if name in names] for group in groups]
    return np.stack([flags[:, own].any(-1) for own in columns], axis=-1)
