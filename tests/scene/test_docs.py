"""docs/scenes.md shows every kind as it is."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import cv2

from simrecon.scene import kinds

CHECKOUT = Path(__file__).resolve().parents[2]


def test_the_tables_are_those_of_the_data() -> None:
    path = CHECKOUT / "tools" / "make_scene_docs.py"
    spec = importlib.util.spec_from_file_location("make_scene_docs", path)
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    assert tool.tables() in (CHECKOUT / "docs" / "scenes.md").read_text(encoding="utf-8")


def test_every_kind_has_a_picture() -> None:
    folder = CHECKOUT / "docs" / "images" / "scenes"
    assert {path.stem for path in folder.iterdir()} == set(kinds.table())
    for path in folder.iterdir():
        assert cv2.imread(str(path)).std() > 10
