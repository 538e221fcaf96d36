"""Every public function and class of `metrics` is one that the package computes with."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

from tests.conftest import CHECKOUT

Definition = ast.FunctionDef | ast.ClassDef


def modules(root: Path) -> dict[str, ast.Module]:
    """Syntax trees by dotted name of the modules of the package in a folder."""
    trees = {}
    for path in sorted(root.rglob("*.py")):
        parts = (root.name, *path.relative_to(root).with_suffix("").parts)
        trees[".".join(parts).removesuffix(".__init__")] = ast.parse(path.read_text(encoding="utf-8"))
    return trees


def public(tree: ast.Module) -> dict[str, Definition]:
    """The public functions and classes that a module defines."""
    kinds = (ast.FunctionDef, ast.ClassDef)
    return {
        node.name: node for node in tree.body if isinstance(node, kinds) and not node.name.startswith("_")
    }


def imported(tree: ast.Module) -> dict[str, str]:
    """The dotted name of what each imported name stands for."""
    names: dict[str, str] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            names |= {alias.asname or alias.name: f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Import):
            names |= {alias.asname or alias.name: alias.name for alias in node.names if alias.asname}
    return names


def names_in(node: ast.AST, aliases: dict[str, str]) -> Iterator[str]:
    """Dotted names that are read below a node, `alias.attribute` resolved."""
    for inner in ast.walk(node):
        if isinstance(inner, ast.Name):
            yield aliases.get(inner.id, inner.id)
        elif isinstance(inner, ast.Attribute) and isinstance(inner.value, ast.Name):
            yield f"{aliases.get(inner.value.id, inner.value.id)}.{inner.attr}"


def used(trees: dict[str, ast.Module]) -> set[str]:
    """Dotted names of all that modules read; a definition's reading of itself does not count."""
    reads = set()
    exports = {
        f"{module}.{name}": target
        for module, tree in trees.items()
        for name, target in imported(tree).items()
    }
    for module, tree in trees.items():
        own = public(tree)
        aliases = {name: f"{module}.{name}" for name in own} | imported(tree)
        for node in tree.body:
            itself = f"{module}.{getattr(node, 'name', '')}"
            reads |= {exports.get(name, name) for name in names_in(node, aliases)} - {itself}
    return reads


def without_caller(root: Path, room: str) -> list[str]:
    """Public functions and classes of a room's modules that no module of the package reads."""
    trees = modules(root)
    reads = used(trees)
    return [
        f"{module}.{name}"
        for module, tree in trees.items()
        if module.startswith(f"{root.name}.{room}.")
        for name in public(tree)
        if f"{module}.{name}" not in reads
    ]


def test_every_public_metric_has_a_caller() -> None:
    assert without_caller(CHECKOUT / "simrecon", "metrics") == []


def test_one_that_is_only_exported_or_calls_itself_is_caught(tmp_path: Path) -> None:
    files = {
        "package/__init__.py": "",
        "package/metrics/__init__.py": (
            "from package.metrics.pose import error, exported\n__all__ = ['error', 'exported']\n"
        ),
        "package/metrics/pose.py": (
            "def error(): return helper()\n"
            "def helper(): return _private()\n"
            "def exported(): return 1\n"
            "def recursive(): return recursive()\n"
            "class Unused: pass\n"
            "def _private(): return 2\n"
            "def aliased(): return 3\n"
            "def inner(): return 4\n"
        ),
        "package/table.py": (
            "from package import metrics\n"
            "from package.metrics import pose as poses\n"
            "from package.metrics.pose import inner\n"
            "def exported(): return metrics.error() + poses.aliased() + inner()\n"
            "print(exported())\n"
        ),
    }
    for name, text in files.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    unused = [f"package.metrics.pose.{name}" for name in ("exported", "recursive", "Unused")]
    assert without_caller(tmp_path / "package", "metrics") == unused
