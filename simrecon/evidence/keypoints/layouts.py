"""Names of landmarks by the order in which networks write them (`models/body/keypoints.toml`)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from simrecon import resources
from simrecon.body import names as body_names
from simrecon.evidence.content import Content

# Counted from the wrist on: thumb's second knuckle, first knuckles of index and little finger.
_HAND = {"thumb": 2, "index": 5, "pinky": 17}

BY_COUNT = ("coco_17", "halpe_26", "wholebody_133", "halpe_136")
"""Layouts that their number of landmarks tells apart."""


@cache
def layout(name: str) -> tuple[str, ...]:
    """Names of the landmarks of a layout, in order, `""` for those that are left out."""
    table = resources.toml("models", "body", "keypoints.toml")[name]
    listed = list(table.get("names", ()))
    listed += [""] * (table["count"] - len(listed))
    for landmark, index in table.get("at", {}).items():
        listed[index] = landmark
    for side, wrist in zip(("left", "right"), table.get("hands", ()), strict=False):
        for finger, after in _HAND.items():
            listed[wrist + after] = f"{side}_{finger}"
    return tuple(listed)


def by_count(content: Content, key: str, count: int, allowed: Sequence[str]) -> tuple[str, ...]:
    """Names of the landmarks of a network by their number.

    Raises:
        InputError: none of the allowed layouts has so many.
    """
    for name in allowed:
        if len(layout(name)) == count:
            return layout(name)
    sizes = ", ".join(f"{len(layout(name))} ({name})" for name in allowed)
    raise content.fail(key, f"{count} landmarks", sizes)


def known(names: Sequence[str]) -> tuple[str, ...]:
    """Names that a file gives its landmarks, `""` for those that the landmark table does not know."""
    return tuple(_known(str(name)) for name in names)


def _known(name: str) -> str:
    flat = name.lower().replace("-", "_").replace(" ", "_")
    if flat in _valid():
        return flat
    side = flat.split("_")[0]
    rest = flat.removeprefix(f"{side}_").replace("_", "")
    short = {"left": "L", "right": "R"}.get(side)
    aliases = resources.toml("models", "body", "keypoints.toml")["aliases"]
    if short and rest in aliases:
        return f"{short}{aliases[rest]}"
    return ""


@cache
def _valid() -> frozenset[str]:
    return frozenset(body_names.valid_names())
