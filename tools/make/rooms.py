"""The rooms of the package: what each is for, how long it is, and which it imports; read from the code.

A room is a package or a module right below `simrecon`. Its floor is that of the import contract in setup.cfg.
"""

from __future__ import annotations

import ast
import configparser
import re
from dataclasses import dataclass
from pathlib import Path

import grimp

from tools import CHECKOUT

ROOT = "simrecon"
PACKAGE = CHECKOUT / ROOT
CONTRACT = "importlinter:contract:floors"

Edge = tuple[str, str]
"""A room, and one that it imports."""


@dataclass(frozen=True)
class Room:
    """A package or a module.

    Attributes:
        name: with `/` behind a package and `.py` behind a module.
        purpose: the first line of its docstring.
        lines: of Python in it.
    """

    name: str
    purpose: str
    lines: int


def rooms() -> dict[str, Room]:
    """All rooms by the name that imports use, in the order of a listing: packages before modules."""
    packages = sorted(path.parent for path in PACKAGE.glob("*/__init__.py"))
    modules = sorted(PACKAGE.glob("*.py"))
    return {path.stem: _room(path) for path in (*packages, *modules)}


def _room(path: Path) -> Room:
    sources = sorted(path.rglob("*.py")) if path.is_dir() else [path]
    first = path / "__init__.py" if path.is_dir() else path
    doc = ast.get_docstring(ast.parse(first.read_text(encoding="utf-8"))) or ""
    lines = sum(len(source.read_text(encoding="utf-8").splitlines()) for source in sources)
    return Room(f"{path.name}/" if path.is_dir() else path.name, doc.split("\n")[0].rstrip("."), lines)


def floors() -> list[list[str]]:
    """Rooms by floor, from top to bottom, as the import contract has them; planned ones are left out."""
    config = configparser.ConfigParser()
    config.read(CHECKOUT / "setup.cfg", encoding="utf-8")
    lines = config[CONTRACT]["layers"].split("\n")
    named = [re.findall(r"\w+", line) for line in lines if line and not line.startswith("#")]
    known = rooms()
    return [floor for names in named if (floor := [name for name in names if name in known])]


def graph() -> grimp.ImportGraph:
    """Imports of all modules, less those of the front door that only type checkers see."""
    return grimp.build_graph(ROOT, exclude_type_checking_imports=True, cache_dir=None)


def edges(imports: grimp.ImportGraph) -> set[Edge]:
    """Which room imports which."""
    pairs: set[Edge] = set()
    for module in imports.modules:
        for other in imports.find_modules_directly_imported_by(module):
            a, b = (name.split(".")[1:2] for name in (module, other))
            if a and b and a != b:
                pairs.add((a[0], b[0]))
    return pairs


def implied(all_edges: set[Edge]) -> set[Edge]:
    """Edges between rooms that are joined by a longer way too."""
    below: dict[str, set[str]] = {}
    for a, b in all_edges:
        below.setdefault(a, set()).add(b)

    def reached(name: str) -> set[str]:
        direct = below.get(name, set())
        return direct.union(*(reached(other) for other in direct))

    reach = {name: reached(name) for name in {end for edge in all_edges for end in edge}}
    return {(a, b) for a, b in all_edges if any(b in reach[c] for c in below[a] - {b})}
