"""The shape of the package: no circles, no imports upwards, short functions and files; and its page."""

from __future__ import annotations

import ast
import statistics
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tools import CHECKOUT

grimp = pytest.importorskip("grimp", reason="comes with import-linter: install the extra dev")

from tools.make import architecture, layered, rooms  # noqa: E402

LONGEST_FUNCTION = 55
LONGEST_FILE = 250
MEDIAN_FILE = 150
PACKAGE = CHECKOUT / "simrecon"
SOURCES = sorted(PACKAGE.rglob("*.py"))


@pytest.fixture(scope="module")
def imports() -> Any:
    return rooms.graph()


def circle(imports: Any) -> list[str]:
    """Modules that import each other in a ring; none if there is no such ring."""
    for module in sorted(imports.modules):
        for other in sorted(imports.find_modules_directly_imported_by(module)):
            chain = imports.find_shortest_chain(other, module)
            if chain is not None:
                return [module, *chain]
    return []


def test_no_modules_import_each_other_in_a_circle(imports: Any) -> None:
    assert circle(imports) == []


def test_a_circle_is_noticed() -> None:
    ring = grimp.ImportGraph()
    for importer, imported in (("a", "b"), ("b", "c"), ("c", "a"), ("c", "d")):
        ring.add_import(importer=importer, imported=imported)
    assert circle(ring) == ["a", "b", "c", "a"]


def test_rooms_import_only_from_floors_below(imports: Any) -> None:
    floor_of = {name: row for row, floor in enumerate(rooms.floors()) for name in floor}
    assert set(floor_of) == set(rooms.rooms()) - {"__init__"}
    upwards = {(a, b) for a, b in rooms.edges(imports) if floor_of[a] >= floor_of[b]}
    assert upwards == set()


def functions(path: Path) -> Iterator[tuple[str, int]]:
    """Names, and lines without the docstring."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            body = node.body[1:] if ast.get_docstring(node) else node.body
            yield node.name, (body[-1].end_lineno or 0) - body[0].lineno + 1 if body else 0


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.relative_to(CHECKOUT).as_posix())
def test_functions_are_short(path: Path) -> None:
    assert {name: lines for name, lines in functions(path) if lines > LONGEST_FUNCTION} == {}


def test_files_are_short() -> None:
    lengths = {
        path.relative_to(PACKAGE).as_posix(): len(path.read_text(encoding="utf-8").splitlines())
        for path in SOURCES
    }
    assert {name: lines for name, lines in lengths.items() if lines > LONGEST_FILE} == {}
    assert statistics.median(lengths.values()) <= MEDIAN_FILE


@pytest.mark.parametrize("name", ["models", "windows"])
def test_no_module_shadows_a_data_folder(name: str) -> None:
    assert not (PACKAGE / f"{name}.py").exists()
    assert not (PACKAGE / name).exists()


def test_the_page_lists_the_rooms_as_they_are() -> None:
    page = architecture.PAGE.read_text(encoding="utf-8")
    assert architecture.listing() in page, "python -m tools.make.architecture"
    assert f"images/{architecture.PICTURE.name}" in page


def test_the_drawing_shows_every_room_inside_the_page(imports: Any) -> None:
    known, edges = rooms.rooms(), rooms.edges(imports)
    text = architecture.drawing(rooms.floors(), edges, known)
    for room in (room for name, room in known.items() if name != "__init__"):
        assert f">{room.name}</text>" in text
    plan = layered.layout(rooms.floors(), edges - rooms.implied(edges))
    reach = max(abs(plan.centre[node]) for node in plan.boxes) + layered.BOX / 2
    assert reach <= architecture.WIDTH / 2


def test_edges_with_a_longer_way_are_implied() -> None:
    assert rooms.implied({("a", "b"), ("b", "c"), ("a", "c"), ("a", "d")}) == {("a", "c")}


def test_boxes_of_a_row_keep_their_distance_and_arrows_point_down() -> None:
    floors = [["a"], ["b", "c"], ["d", "e"], ["f"]]
    edges = {("a", "b"), ("a", "c"), ("b", "e"), ("c", "d"), ("a", "f"), ("d", "f")}
    plan = layered.layout(floors, edges)
    assert all(upper[1] + 1 == lower[1] for upper, lower in plan.links)
    for row in (1, 2):
        left, right = sorted(plan.centre[name, row] for name in floors[row])
        assert right - left >= layered.BOX
    with pytest.raises(ValueError, match="f imports a"):
        layered.layout(floors, {("f", "a")})
