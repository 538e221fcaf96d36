"""Layout of a graph whose arrows all point downwards: boxes in rows, and lanes between them for long arrows.

All arrows to one box share a lane in the rows that they cross. The order within a row lowers the number of
crossings by barycentres, sweep by sweep (Sugiyama, Tagawa and Toda 1981); then places within a row come as
near to the mean of the neighbours above and below as distances allow (isotonic regression).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

SWEEPS = 48
WIDTH, BOX, LANE, GAP = 1170.0, 320.0, 8.0, 14.0
"""Widths of all, of a box and of a lane, and the gap between neighbours."""
STRAIGHT = 8
"""How much more a lane follows its own pieces above and below than the boxes at its ends."""

Node = tuple[str, int]
"""A box's or lane's target, and the row."""
Link = tuple[Node, Node]
"""Between neighbouring rows."""


@dataclass(frozen=True)
class Layout:
    """Where everything is.

    Attributes:
        centre: of each node, along the row, 0 in the middle.
        links: pieces of arrows from row to row.
        boxes: which nodes are boxes; the others are lanes.
    """

    centre: dict[Node, float]
    links: tuple[Link, ...]
    boxes: frozenset[Node]


def layout(floors: Sequence[Sequence[str]], edges: set[tuple[str, str]]) -> Layout:
    """Lay out boxes by floor, from top to bottom.

    Raises:
        ValueError: an arrow does not point downwards.
    """
    row_of = {name: row for row, floor in enumerate(floors) for name in floor}
    rows: list[list[Node]] = [[(name, row) for name in floor] for row, floor in enumerate(floors)]
    boxes = frozenset(node for row in rows for node in row)
    links: set[Link] = set()
    for a, b in sorted(edges):
        if row_of[a] >= row_of[b]:
            raise ValueError(f"{a} imports {b}, which is not below it")
        path = [(a, row_of[a]), *((b, row) for row in range(row_of[a] + 1, row_of[b] + 1))]
        links |= set(pairwise(path))
    for node in sorted({end for link in links for end in link} - boxes):
        rows[node[1]].append(node)
    neighbours = _neighbours(links)
    rows = _ordered(rows, neighbours, links)
    return Layout(_centres(rows, neighbours, boxes), tuple(sorted(links)), boxes)


def _neighbours(links: set[Link]) -> dict[Node, tuple[list[Node], list[Node]]]:
    """Of each node those in the row above, and those in the row below."""
    sides: dict[Node, tuple[list[Node], list[Node]]] = {}
    for a, b in sorted(links):
        sides.setdefault(a, ([], []))[1].append(b)
        sides.setdefault(b, ([], []))[0].append(a)
    return sides


def _ordered(
    rows: list[list[Node]], neighbours: dict[Node, tuple[list[Node], list[Node]]], links: set[Link]
) -> list[list[Node]]:
    """The order of fewest crossings that the sweeps come by."""
    best, fewest = rows, _crossings(rows, links)
    for sweep in range(SWEEPS):
        side = sweep % 2  # 0: downwards, by the row above
        sequence = range(1, len(rows)) if side == 0 else range(len(rows) - 2, -1, -1)
        rows = [list(row) for row in rows]
        for index in sequence:
            place = {node: i / len(row) for row in rows for i, node in enumerate(row)}

            def key(node: Node, place: dict[Node, float] = place, side: int = side) -> float:
                near = neighbours.get(node, ([], []))[side]
                return sum(place[other] for other in near) / len(near) if near else place[node]

            rows[index].sort(key=key)
        if (count := _crossings(rows, links)) < fewest:
            best, fewest = rows, count
    return best


def _crossings(rows: list[list[Node]], links: set[Link]) -> int:
    place = {node: i for row in rows for i, node in enumerate(row)}
    by_row: dict[int, list[tuple[int, int]]] = {}
    for a, b in links:
        by_row.setdefault(a[1], []).append((place[a], place[b]))
    return sum(
        (a[0] - b[0]) * (a[1] - b[1]) < 0
        for pairs in by_row.values()
        for i, a in enumerate(pairs)
        for b in pairs[:i]
    )


def _centres(
    rows: list[list[Node]], neighbours: dict[Node, tuple[list[Node], list[Node]]], boxes: frozenset[Node]
) -> dict[Node, float]:
    """Places along the rows, in the order that they have."""
    width = {node: BOX if node in boxes else LANE for row in rows for node in row}
    centre: dict[Node, float] = {}
    for row in rows:
        centre |= dict(zip(row, _spread([0.0] * len(row), [width[node] for node in row]), strict=True))
    for sweep in range(SWEEPS):
        for row in rows if sweep % 2 == 0 else rows[::-1]:
            goals = []
            for node in row:
                near = [other for side in neighbours.get(node, ([], [])) for other in side]
                weights = [1 if {node, other} & boxes else STRAIGHT for other in near]
                total = sum(centre[other] * weight for other, weight in zip(near, weights, strict=True))
                goals.append(total / sum(weights) if near else centre[node])
            centre |= dict(zip(row, _spread(goals, [width[node] for node in row]), strict=True))
    return centre


def _spread(goals: Sequence[float], widths: Sequence[float]) -> list[float]:
    """Places in this order and within the width, as near to the goals as distances allow: least squares."""
    offsets, at = [], 0.0
    for before, own in zip([0.0, *widths], widths, strict=False):
        at += (before + own) / 2 + (GAP if before else 0.0)
        offsets.append(at)
    blocks: list[tuple[float, int]] = []  # mean, members
    for goal, offset in zip(goals, offsets, strict=True):
        mean, count = goal - offset, 1
        while blocks and blocks[-1][0] > mean:
            before_mean, before_count = blocks.pop()
            mean = (before_mean * before_count + mean * count) / (before_count + count)
            count += before_count
        blocks.append((mean, count))
    room = WIDTH - offsets[-1] - widths[-1] / 2
    means = [min(max(mean, -WIDTH / 2), room - WIDTH / 2) for mean, count in blocks for _ in range(count)]
    return [mean + offset for mean, offset in zip(means, offsets, strict=True)]
