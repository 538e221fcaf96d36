"""docs/scenes.md shows every kind as it is."""

from __future__ import annotations

import cv2

from simrecon.scene import kinds
from tools import CHECKOUT
from tools.make import scene_docs


def test_the_tables_are_those_of_the_data() -> None:
    assert scene_docs.tables() in (CHECKOUT / "docs" / "scenes.md").read_text(encoding="utf-8")


def test_every_kind_has_a_picture() -> None:
    folder = CHECKOUT / "docs" / "images" / "scenes"
    assert {path.stem for path in folder.iterdir()} == set(kinds.table())
    for path in folder.iterdir():
        image = cv2.imread(str(path))
        assert image is not None
        assert image.std() > 10
