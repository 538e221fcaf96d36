"""What the labels of markers and keypoints mean (`models/body/markers.toml`)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from typing import Any

from simrecon import resources

_SIDED = (
    re.compile(r"(?P<side>left|right)[\W_]*(?P<rest>.+)", re.IGNORECASE),
    re.compile(r"(?P<side>[lr])[\W_]*(?P<rest>.+)", re.IGNORECASE),
    re.compile(r"(?P<rest>.+?)[\W_]*(?P<side>left|right)", re.IGNORECASE),
    re.compile(r"(?P<rest>.+)[\W_]+(?P<side>[lr])", re.IGNORECASE),
    re.compile(r"(?P<rest>.*[a-z\d]|.JC)(?P<side>[LR])"),
)
_WITHIN = re.compile(r"(?P<before>.*[a-z])(?P<side>[LR])(?P<after>[A-Z].*)")
OPENCAP_SUFFIX = "_study"
"""Of the markers that OpenCap computes from keypoints, which stand beside them."""


@cache
def table(name: str) -> dict[str, Any]:
    """One table of `markers.toml`."""
    group: dict[str, Any] = resources.toml("models", "body", "markers.toml")[name]
    return group


def flat(text: str) -> str:
    """In lower case, without separators."""
    return re.sub(r"[^a-z0-9]", "", text.lower())


def readings(label: str) -> Iterator[tuple[str, str]]:
    """Side (`left`, `right` or none) and flat name that a label may stand for, the whole label first."""
    label = label.strip()
    label = label.removesuffix(OPENCAP_SUFFIX)
    yield "", flat(label)
    for pattern in _SIDED:
        if hit := pattern.fullmatch(label):
            yield _side(hit["side"]), flat(hit["rest"])
    if hit := _WITHIN.fullmatch(label):
        yield _side(hit["side"]), flat(hit["before"] + hit["after"])


def find(group: str, labels: Sequence[str]) -> dict[str, int]:
    """Index of the label of each point of a group of `markers.toml`, sided ones with `left_` or `right_`."""
    at: dict[str, tuple[int, int]] = {}
    for i, label in enumerate(labels):
        for point, rank in meanings(group, label):
            if point not in at or rank < at[point][0]:
                at[point] = (rank, i)
    return {point: i for point, (_, i) in at.items()}


def meanings(group: str, label: str) -> Iterator[tuple[str, int]]:
    """Points of a group that a label may stand for, each with its place among that point's names."""
    for side, name in readings(label):
        if points := _index(group, "sided" if side else "middle").get(name):
            for point, rank in points:
                yield f"{side}_{point}" if side else point, rank
            return  # the first reading that means anything


def cluster(bone: str, side: str, names: Sequence[str]) -> list[int]:
    """Which labels are markers of a bone on one side (`[cluster]` of `markers.toml`)."""
    members = frozenset(table("cluster")[bone])
    return [i for i, label in enumerate(names) if any(s == side and n in members for s, n in readings(label))]


def is_skin(label: str) -> bool:
    """Whether a label is that of a marker on the skin and can be no joint of a keypoint set."""
    others = frozenset(table("skin")["others"]["names"])
    if any(name in others for _, name in readings(label)):
        return True
    return any(meanings("skin", label)) and not any(meanings("keypoint", label))


def is_keypoint(label: str) -> bool:
    """Whether a label is that of a joint or landmark of a keypoint set and can be no marker on the skin."""
    return any(meanings("keypoint", label)) and not any(meanings("skin", label))


def is_body(label: str) -> bool:
    """Whether a label means any point of a body."""
    return is_skin(label) or any(any(meanings(group, label)) for group in ("skin", "centre", "keypoint"))


def example(group: str, point: str) -> str:
    """Names of a point, for messages."""
    bare = re.sub("^(left|right)_", "", point)
    names: list[str] = next((part[bare] for part in table(group).values() if bare in part), [])
    return ", ".join(names[:6])


def _side(text: str) -> str:
    return "left" if text.lower().startswith("l") else "right"


@cache
def _index(group: str, part: str) -> Mapping[str, tuple[tuple[str, int], ...]]:
    """Points and places in their lists by flat name."""
    index: dict[str, tuple[tuple[str, int], ...]] = {}
    for point, names in table(group).get(part, {}).items():
        for rank, name in enumerate(names):
            index[name] = (*index.get(name, ()), (point, rank))
    return index
