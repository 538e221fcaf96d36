"""What the names of joints and markers mean (`models/body/mocap.toml`)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any

from simrecon import resources


@cache
def table(name: str) -> dict[str, Any]:
    """One table of `mocap.toml`."""
    group: dict[str, Any] = resources.toml("models", "body", "mocap.toml")[name]
    return group


def flat(name: str) -> str:
    """A name in lower case, without prefix and separators."""
    bare = re.split(r"[:|]", name)[-1]
    bare = re.sub(r"^(Character\d*|mixamorig\d*|CC_Base|Bip\d*|Armature)[_ ]", "", bare)
    bare = re.sub(r"_(study|reg)$", "", bare) if not bare.lower().endswith("hjc_reg") else bare
    return re.sub(r"[^a-z0-9]", "", bare.lower())


def sides(point: str) -> Iterator[tuple[str, str]]:
    """A point on the left and on the right with the letter that its side's names have; the middle once."""
    if not point.startswith("left_"):
        yield point, ""
        return
    yield point, "l"
    yield point.replace("left_", "right_", 1), "r"


def on_side(name: str, side: str) -> str:
    """A name of the left side as that of another."""
    if side != "r":
        return name
    if name.startswith("left"):
        return f"right{name[4:]}"
    return f"r{name[1:]}" if name.startswith("l") else f"{name[:-1]}r" if name.endswith("l") else name


def joints(names: Sequence[str]) -> dict[str, int]:
    """Index of the joint that each point of the body is, for those that the names tell."""
    index: dict[str, int] = {}
    for i, name in enumerate(names):
        index.setdefault(flat(name), i)
    at = {}
    for point, candidates in table("joint").items():
        for named, side in sides(point):
            hit = next((index[on_side(c, side)] for c in candidates if on_side(c, side) in index), None)
            if hit is not None:
                at[named] = hit
    return at
