"""Whose markers they are: files of several subjects name them `Subject:LASI`, `P1_LKnee` or `LKnee-2`."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from simrecon.evidence import people
from simrecon.evidence.content import Content
from simrecon.evidence.mocap import labels as meaning

COMMON_MIN = 4
"""So many points of a body make a person of a group of labels; fewer are a thing, or no group at all."""
_WHERE = (
    "l r left right lat lateral med medial front back rear upper lower in out prox dist top bottom study reg"
)
_NOBODY = frozenset(_WHERE.split(" "))
"""Parts of labels that say where on the body a marker is, and not on whose."""
_MARK = re.compile(r"[:|]")
_SEPARATOR = re.compile(r"[_\-. /]")


def of_one(content: Content, labels: Sequence[str], person: str | None) -> tuple[list[int], list[str], str]:
    """The labels of one person.

    Args:
        content: the file, for messages.
        labels: of all markers; without a name where a marker has none.
        person: of the user's choice.

    Returns:
        Which labels, what they are without the person's name, and the choice for the reading.

    Raises:
        InputError: several people and no choice, or no such person.
    """
    split = _marked(labels) or _prefixed(labels) or _suffixed(labels) or _repeated(labels)
    if split is None:
        split = [("", label) for label in labels]
    names = Counter(name for name, label in split if meaning.is_body(label))
    bodies = {name: count for name, count in names.items() if count >= COMMON_MIN}
    if not bodies and person is None:
        return list(range(len(labels))), [label for _, label in split], ""
    counts = {name or "unnamed": count for name, count in bodies.items()}
    chosen = people.choose(content, counts, person, "marker")
    rows = [i for i, (name, _) in enumerate(split) if (name or "unnamed") == chosen]
    return rows, [split[i][1] for i in rows], people.named(counts, chosen)


def _marked(labels: Sequence[str]) -> list[tuple[str, str]] | None:
    """Names before a colon or a bar, as Vicon, OptiTrack and Qualisys write them."""
    if not any(_MARK.search(label) for label in labels):
        return None
    return [
        (match[0].strip(), match[1].strip())
        if len(match := _MARK.split(label, maxsplit=1)) > 1
        else ("", label)
        for label in labels
    ]


def _prefixed(labels: Sequence[str]) -> list[tuple[str, str]] | None:
    """Names before another separator, if several of them stand before the same points."""
    splits = [[(label[: hit.start()], label[hit.end() :]) for hit in _separators(label)] for label in labels]
    return _grouped(labels, splits)


def _suffixed(labels: Sequence[str]) -> list[tuple[str, str]] | None:
    """Names behind a separator."""
    splits = [[(label[hit.end() :], label[: hit.start()]) for hit in _separators(label)] for label in labels]
    return _grouped(labels, splits)


def _separators(label: str) -> list[re.Match[str]]:
    """Where a name may end; nowhere in a label that is a point of the body as it stands."""
    if meaning.is_body(label):
        return []
    return [hit for hit in _SEPARATOR.finditer(label) if hit.start() > 0 and hit.end() < len(label)]


def _grouped(labels: Sequence[str], splits: list[list[tuple[str, str]]]) -> list[tuple[str, str]] | None:
    """The split whose names share points of the body; none where fewer than two do."""
    points: dict[str, set[str]] = {}
    for label, candidates in zip(labels, splits, strict=True):
        for name, rest in candidates:
            if name.lower() not in _NOBODY and meaning.is_body(rest):
                points.setdefault(name, set()).add(meaning.flat(rest))
        if not candidates and meaning.is_body(label):
            points.setdefault("", set()).add(meaning.flat(label))
    enough = {name: mine for name, mine in points.items() if len(mine) >= COMMON_MIN}
    names = {
        name
        for name, mine in enough.items()
        if any(len(mine & others) >= COMMON_MIN for other, others in enough.items() if other != name)
    }
    if len(names) < 2:
        return None
    return [
        next(
            ((name, rest) for name, rest in candidates if name in names and meaning.is_body(rest)),
            ("", label),
        )
        for label, candidates in zip(labels, splits, strict=True)
    ]


def _repeated(labels: Sequence[str]) -> list[tuple[str, str]] | None:
    """The same labels again and again: the people have no names but their order."""
    counts = Counter(meaning.flat(label) for label in labels if meaning.is_body(label))
    if sum(count > 1 for count in counts.values()) < COMMON_MIN:
        return None
    before: Counter[str] = Counter()
    split = []
    for label in labels:
        name = meaning.flat(label)
        before[name] += 1
        split.append((str(before[name]), label))
    return split
