"""What the names of joints and markers mean (`models/body/mocap.toml`)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import takewhile
from typing import Any

from simrecon import resources

EXACT, WITHIN = 6.0, 4.0
FEW = 6  # so many names are no sign that what they share is a prefix
LONGEST_SIDE = 6  # letters of a word for a side


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


def words(given: Sequence[str]) -> list[dict[str, float]]:
    """What each name says for its joint's being a point, left and right alike, in squared deviations.

    A name of `[joint]` counts `EXACT`, the earlier in its list the more, a word of `[word]` in it `WITHIN`.
    """
    shared = _shared([name for name in given if name])
    said = []
    for name in given:
        bare = flat(name[len(shared) :] if name.startswith(shared) else name)
        found: dict[str, float] = {}
        held = max(
            ((word, point) for point, group in table("word").items() for word in group if word in bare),
            key=lambda entry: len(entry[0]),
            default=None,
        )
        if held is not None:
            found[held[1]] = WITHIN
        for point, candidates in {} if held is not None and held[1] == "helper" else table("joint").items():
            for i, candidate in enumerate(candidates):
                if bare in (candidate, on_side(candidate, "r")):
                    found[point] = EXACT - 0.1 * i
        said.append(found)
    return said


def _shared(given: Sequence[str]) -> str:
    """What most names begin with, up to the last separator or capital letter in it."""
    if len(given) < FEW:
        return ""
    ordered = sorted(given)
    start = _common(ordered[len(ordered) // 10], ordered[-1 - len(ordered) // 10])
    return re.sub(r"[a-zA-Z0-9]*$", "", start)


def _common(a: str, b: str) -> str:
    """What both begin with."""
    same = (x == y for x, y in zip(a, b, strict=False))
    return a[: sum(takewhile(bool, same))]


def is_left(first: str, second: str) -> bool | None:
    """Whether the first of two names of a pair is the left one; None where they don't say.

    They differ by `left` and `right`, `l` and `r` or the like, whatever stands around it.
    """
    a, b = (re.sub(r"\d+", "", name).lower() for name in (first, second))
    for left, right in (("left", "right"), ("左", "右")):
        if (left in a and right in b) or (right in a and left in b):
            return left in a
    start = len(_common(a, b))
    end = len(_common(a[start:][::-1], b[start:][::-1]))
    parts = tuple(name[start : len(name) - end] for name in (a, b))
    if all(0 < len(part) <= LONGEST_SIDE for part in parts):
        initials = parts[0][0] + parts[1][0]
        return {"lr": True, "rl": False}.get(initials)
    return None


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


def joint_points() -> tuple[str, ...]:
    """The points of the body that a skeleton may have, both sides."""
    return tuple(named for point in table("joint") for named, _ in sides(point))
