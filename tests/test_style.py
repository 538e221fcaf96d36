"""Rules of the house that no linter checks."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "simrecon"
SOURCES = sorted(PACKAGE.rglob("*.py"))


def body_lines(function: ast.FunctionDef) -> int:
    """Lines of a function's body without its docstring."""
    body = function.body[1:] if ast.get_docstring(function) else function.body
    return body[-1].end_lineno - body[0].lineno + 1 if body else 0


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_modules_and_functions_are_short(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    lengths = {
        node.name: body_lines(node) for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef)
    }
    assert len(text.splitlines()) <= 380
    assert {name: lines for name, lines in lengths.items() if lines > 55} == {}


@pytest.mark.parametrize("name", ["models", "windows"])
def test_no_module_shadows_a_data_folder(name: str) -> None:
    assert not (PACKAGE / f"{name}.py").exists()
    assert not (PACKAGE / name).exists()
