"""Names of landmarks by the order in which networks write them (`models/body/keypoints.toml`)."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from simrecon import resources
from simrecon.body import names as body_names
from simrecon.evidence.content import Content
from simrecon.io.messages import counted

# Counted from the wrist on: thumb's second knuckle, first knuckles of index and little finger.
_HAND = {"thumb": 2, "index": 5, "pinky": 17}
_SIDES = {"left": "left", "l": "left", "right": "right", "r": "right"}


@dataclass(frozen=True)
class Order:
    """Landmarks without names, of which the number and the person's proportions tell the layout.

    Attributes:
        key: of the file, for messages.
        allowed: layouts that may be meant.
    """

    key: str
    allowed: tuple[str, ...]


@cache
def _table() -> Mapping[str, Any]:
    return resources.toml("models", "body", "keypoints.toml")


@cache
def all_names() -> tuple[str, ...]:
    """Names of the layouts."""
    return tuple(name for name, table in _table().items() if "count" in table)


@cache
def layout(name: str) -> tuple[str, ...]:
    """Names of the landmarks of a layout, in order, `""` for those that are left out."""
    table = _table()[name]
    listed = list(table.get("names", ()))
    listed += [""] * (table["count"] - len(listed))
    for landmark, index in table.get("at", {}).items():
        listed[index] = landmark
    for side, wrist in zip(("left", "right"), table.get("hands", ()), strict=False):
        for finger, after in _HAND.items():
            listed[wrist + after] = f"{side}_{finger}"
    return tuple(listed)


def counts() -> frozenset[int]:
    """How many landmarks layouts have."""
    return frozenset(len(layout(name)) for name in all_names())


def by_count(content: Content, order: Order, count: int, choice: str | None = None) -> tuple[str, ...]:
    """The layouts of a number of landmarks.

    Args:
        content: the file, for messages.
        order: which ones may be meant.
        count: of the landmarks.
        choice: of the user, who may choose any.

    Raises:
        InputError: none, or the user's has another number.
    """
    if choice is not None and len(layout(choice)) != count:
        fitting = ", ".join(name for name in all_names() if len(layout(name)) == count)
        raise content.fail(
            "--layout", f"{choice} for {counted(count, 'landmark')}", fitting or "a file of another number"
        )
    fitted = (choice,) if choice else tuple(name for name in order.allowed if len(layout(name)) == count)
    if not fitted:
        sizes = ", ".join(f"{len(layout(name))} ({name})" for name in order.allowed)
        raise content.fail(order.key, f"{counted(count, 'landmark')}", sizes)
    return fitted


def known(names: Sequence[str]) -> tuple[str, ...]:
    """Names that a file gives its landmarks as points of the body, each once; `""` for all others.

    `head` is the crown, as networks have it, unless the crown has a name of its own. Sets with a thorax are
    Human3.6M's: the spine lies in the middle of the trunk. Feet without ankles, and hands without wrists, are
    these.
    """
    human = _table()["deeplabcut_human"]
    if set(human["names"]) <= {str(name).lower() for name in names}:
        special = dict(zip(human["names"], human["points"], strict=True))
        return tuple(special.get(str(name).lower(), "") for name in names)
    parts = [_parts(str(name)) for name in names]
    bare = {rest for _, rest in parts}
    aliases = {**_table()["aliases"]}
    for other, joint in _table()["aliases_h36m"].items():
        if joint not in bare and other in bare:
            aliases[other] = joint
    if "thorax" in bare:
        aliases["spine"] = "chest"
    if bare & {name for name, point in aliases.items() if point == "head_top" and name != "head"}:
        aliases["head"] = "head"
    found: list[str] = []
    for name, (side, rest) in zip(names, parts, strict=True):
        point = _point(str(name), side, rest, aliases)
        found.append("" if point in found else point)
    return tuple(found)


def _point(name: str, side: str, rest: str, aliases: Mapping[str, str]) -> str:
    """The point of a name, whose parts are its side and the rest of it."""
    if not side and rest == "hip":
        return "pelvis"
    rest = aliases.get(rest, rest)
    flat = re.sub(r"[^a-z0-9]+", "_", name.lower())
    for candidate in (f"{side}_{rest}" if side else rest, flat if rest else ""):
        if candidate in _points() or candidate in _valid():
            return candidate
    return ""


def _parts(name: str) -> tuple[str, str]:
    """The side that a name says, or `""`, and the rest in lower case without separators."""
    spaced = re.sub(r"([a-z0-9])([A-Z])|([LR])(?=[A-Z][a-z])", r"\1\3 \2", name).lower()
    words = [word for word in re.split(r"[^a-z0-9]+", spaced) if word]
    side = next((word for word in words if word in _SIDES), "")
    if side:
        words.remove(side)
    rest = "".join(words)
    if not side and (split := re.match(r"(left|right|l|r)(.+)", rest)):
        after = split[2]
        if f"left_{after}" in _points() or after in _table()["aliases"]:
            side, rest = split[1], after
    return _SIDES.get(side, ""), rest


@cache
def _points() -> frozenset[str]:
    return frozenset(point["name"] for point in body_names.points())


@cache
def _valid() -> frozenset[str]:
    return frozenset(body_names.valid_names())
