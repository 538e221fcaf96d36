"""Draw docs/images/architecture.svg from the code's own imports, and list the rooms in docs/architecture.md.

usage: python -m tools.make.architecture

Floors are those of the import contract in setup.cfg. An arrow goes from a room to one that it imports; it is
faint where a longer way joins the two as well. Needs grimp, which comes with import-linter (extra `dev`).
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from html import escape

from tools import CHECKOUT
from tools.make import layered, rooms
from tools.make.layered import BOX, Layout, Node
from tools.make.rooms import Edge, Room

PAGE = CHECKOUT / "docs" / "architecture.md"
PICTURE = CHECKOUT / "docs" / "images" / "architecture.svg"
BEGIN, END = "<!-- rooms: made by tools/make/architecture.py -->", "<!-- end of rooms -->"
STAGES = ("evidence", "kinematics", "planners", "engines", "replay", "results")
"""Rooms that data goes through, from a file to a result folder."""
WIDTH, HEIGHT, PITCH, MARGIN = 1200.0, 54.0, 86.0, 16.0
WRAP = 51
INK, FAINT, PAPER, EDGE, STAGE = "#1f2933", "#c8d0d8", "#ffffff", "#9aa5b1", "#e8f1fb"
STYLE = f"""
  text {{ font: 11px Helvetica, Arial, sans-serif; fill: {INK}; }}
  .name {{ font-size: 14px; font-weight: bold; }}
  .lines {{ fill: #616e7c; text-anchor: end; }}
  .box {{ fill: {PAPER}; stroke: {EDGE}; }}
  .stage {{ fill: {STAGE}; stroke: #4a90d9; stroke-width: 1.5; }}
  .arrow {{ fill: none; stroke: #52606d; stroke-width: 1.3; }}
  .implied {{ fill: none; stroke: {FAINT}; stroke-width: 0.8; opacity: 0.55; }}
"""


def tree(listed: Iterable[Room]) -> str:
    """The rooms as a listing of the folder, with what each is for."""
    listed = list(listed)
    width = max(len(room.name) for room in listed)
    branches = ["├── "] * (len(listed) - 1) + ["└── "]
    rows = [
        f"{branch}{room.name:{width}}  {room.purpose}" for branch, room in zip(branches, listed, strict=True)
    ]
    return "\n".join([f"{rooms.ROOT}/", *rows])


def listing() -> str:
    """The part of the page that is made here."""
    return f"{BEGIN}\n\n```text\n{tree(rooms.rooms().values())}\n```\n\n{END}"


def drawing(floors: list[list[str]], edges: set[Edge], known: dict[str, Room]) -> str:
    """The picture as SVG."""
    faint = rooms.implied(edges)
    plan = layered.layout(floors, edges - faint)
    centre = {node: x + WIDTH / 2 for node, x in plan.centre.items()}
    height = PITCH * len(floors) - (PITCH - HEIGHT) + 2 * MARGIN
    row_of = {name: row for row, floor in enumerate(floors) for name in floor}
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:g} {height:g}" width="{WIDTH:g}">',
        f"<title>The rooms of simrecon and what they import</title><style>{STYLE}</style>",
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" '
        'orient="auto"><path d="M0 0 8 4 0 8z" fill="#52606d"/></marker></defs>',
        f'<rect width="{WIDTH:g}" height="{height:g}" fill="{PAPER}"/>',
        *(_curve((a, row_of[a]), (b, row_of[b]), centre, "implied") for a, b in sorted(faint)),
        *_arrows(plan, centre),
        *(_box(known[node[0]], node, centre[node], node[0] in STAGES) for node in sorted(plan.boxes)),
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


def _top(row: int) -> float:
    return MARGIN + PITCH * row


def _arrows(plan: Layout, centre: dict[Node, float]) -> Iterable[str]:
    """All arrows in pieces; a lane goes straight through its row."""
    for node in sorted({end for link in plan.links for end in link} - plan.boxes):
        x, top = centre[node], _top(node[1])
        yield f'<path class="arrow" d="M{x:.1f} {top:.1f}V{top + HEIGHT:.1f}"/>'
    for a, b in plan.links:
        yield _curve(a, b, centre, "arrow", tip=b in plan.boxes)


def _curve(a: Node, b: Node, centre: dict[Node, float], kind: str, *, tip: bool = False) -> str:
    start, end = _top(a[1]) + HEIGHT, _top(b[1])
    middle = (start + end) / 2
    mark = ' marker-end="url(#tip)"' if tip else ""
    x, to = centre[a], centre[b]
    path = f"M{x:.1f} {start:.1f}C{x:.1f} {middle:.1f} {to:.1f} {middle:.1f} {to:.1f} {end:.1f}"
    return f'<path class="{kind}" d="{path}"{mark}/>'


def _box(room: Room, node: Node, x: float, stage: bool) -> str:
    left, top = x - BOX / 2, _top(node[1])
    text = textwrap.wrap(room.purpose.replace("`", ""), WRAP, max_lines=2, placeholder=" …")
    lines = [
        f'<text x="{left + 9:.1f}" y="{top + 33 + 14 * i:.1f}">{escape(line)}</text>'
        for i, line in enumerate(text)
    ]
    return (
        f'<rect class="{"stage" if stage else "box"}" x="{left:.1f}" y="{top:.1f}" rx="5" '
        f'width="{BOX:g}" height="{HEIGHT:g}"/>'
        f'<text class="name" x="{left + 9:.1f}" y="{top + 17:.1f}">{escape(room.name)}</text>'
        f'<text class="lines" x="{left + BOX - 9:.1f}" y="{top + 17:.1f}">{room.lines:,} lines</text>'
        f"{''.join(lines)}"
    )


def main() -> None:
    """Write the picture and the listing, and print the listing."""
    known = rooms.rooms()
    PICTURE.write_text(drawing(rooms.floors(), rooms.edges(rooms.graph()), known), encoding="utf-8")
    page = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(page.split(BEGIN)[0] + listing() + page.split(END)[1], encoding="utf-8")
    print(tree(known.values()))


if __name__ == "__main__":
    main()
