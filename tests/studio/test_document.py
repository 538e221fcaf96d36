"""Edits of scene and wishes: checked, undone, done again, and with the comments of the file."""

from __future__ import annotations

import pytest

from simrecon.errors import InputError
from simrecon.scene import kinds
from simrecon.studio import document
from simrecon.studio.document import Document, Edits
from simrecon.types import ContactWish

SCENE = """# a room
[ground]
friction = 0.8 # wood

[[item]]
name = "step"
kind = "box"
position_m = [1.0, 0.0, 0.0] # measured
size_m = [0.3, 0.8, 0.2]
"""


def test_an_edit_keeps_the_comments_and_can_be_undone_and_done_again() -> None:
    opened = Document(SCENE)
    opened.set("step", {"position_m": [1.5, 0.0, 0.0]})
    assert "position_m = [1.5, 0.0, 0.0] # measured" in opened.edits.scene
    assert opened.edits.scene.startswith("# a room")
    assert opened.unsaved
    opened.undo()
    assert opened.edits.scene == SCENE
    assert not opened.unsaved
    assert opened.redoes == "step: position_m"
    opened.redo()
    assert opened.scene.items[0].position_m == (1.5, 0.0, 0.0)
    opened.undo()
    opened.remove("step")
    assert opened.redoes == ""
    assert opened.scene.items == ()


def test_a_drag_is_one_edit_to_undo() -> None:
    opened = Document(SCENE)
    for step in range(5):
        opened.set("step", {"position_m": [1.0 + 0.1 * step, 0.2, 0.0]}, merge="drag")
    opened.settle()
    opened.set("step", {"position_m": [3.0, 0.0, 0.0]}, merge="drag")
    opened.undo()
    assert opened.item("step").position_m == (1.4, 0.2, 0.0)
    opened.undo()
    assert opened.edits.scene == SCENE


def test_what_is_not_valid_changes_nothing() -> None:
    opened = Document(SCENE)
    for values in ({"size_m": [0.3, 0.8, -1.0]}, {"colour": "red"}, {"position_m": [0.0, 0.0]}):
        with pytest.raises(InputError):
            opened.set("step", values)
    with pytest.raises(InputError, match="there is no item 'chair'"):
        opened.remove("chair")
    assert opened.edits.scene == SCENE
    assert not opened.undoes


@pytest.mark.parametrize("kind", [kind for kind in document.kinds_to_add() if kind != "mesh"])
def test_every_kind_can_be_added_and_is_of_a_usual_size(kind: str) -> None:
    opened = Document(SCENE)
    first, second = opened.add(kind, (0.0, 0.0, 0.0)), opened.add(kind, (1.0, 0.0, 0.0))
    assert (first, second) == (kind, f"{kind}_2")
    assert opened.item(second).position_m == (1.0, 0.0, 0.0)
    assert opened.item(first).kind in kinds.table()


def test_a_mesh_needs_its_file() -> None:
    with pytest.raises(InputError, match="file"):
        Document(SCENE).add("mesh", (0.0, 0.0, 0.0))


def test_wishes_are_part_of_what_is_undone_and_saved() -> None:
    opened, changes = Document(SCENE), []
    opened.on_change = lambda: changes.append(opened.edits.label)
    wish = (ContactWish("left_heel", touch=((0.1, 0.2),)),)
    opened.wish(wish, "painted")
    opened.wish(wish, "the same again")
    assert changes == ["painted"]
    opened.saved_scene()
    assert opened.unsaved
    opened.saved_wishes()
    assert not opened.unsaved
    opened.undo()
    assert opened.edits.wishes == ()
    assert opened.unsaved


def test_a_state_from_elsewhere_is_taken_up() -> None:
    opened = Document(SCENE)
    opened.restore(Edits(SCENE.replace("0.8 # wood", "0.5"), (), "friction"))
    assert opened.scene.ground.friction.sliding == 0.5
    assert opened.undoes == "friction"
    with pytest.raises(InputError):
        opened.restore(Edits("[ground]\nheight = 1"))


def test_an_item_gets_another_name_and_keeps_its_comments() -> None:
    opened = Document(SCENE)
    other = opened.add("chair", (3.0, 0.0, 0.0))
    opened.rename("step", "kerb")
    assert [item.name for item in opened.scene.items] == ["kerb", other]
    assert "position_m = [1.0, 0.0, 0.0] # measured" in opened.edits.scene
    for wanted in ("", " ", other, "ground"):
        with pytest.raises(InputError, match="valid: a name that no other item has"):
            opened.rename("kerb", wanted)
    opened.rename("kerb", "kerb")
    opened.undo()
    assert opened.item("step").position_m == (1.0, 0.0, 0.0)
