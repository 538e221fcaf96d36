"""Changes to a scene file keep its comments, order and spelling."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simrecon import scene as scenes
from simrecon.errors import InputError
from simrecon.scene.edit import Edited
from simrecon.types import SceneItem

TEXT = """\
# The gym, measured on a Tuesday.

# Its floor
[ground]  # of wood
friction = 0.70  # worn

# Where she sits
# at first.
[[item]]
name = "seat"
kind = "chair"
position_m = [1, 0.5, 0]  # by tape
arms = true
# back = false

# The rail
[[ item ]] # second
name = 'rail'
kind = "beam"
position_m = [0,
  0, 0]
length_m = 3.0
width_m = 0.1
height_m = 0.05

# The end.
"""


def edited(path: Path, text: str = TEXT) -> Edited:
    path.write_bytes(text.encode())
    return Edited.read(path)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "gym.toml"


def test_nothing_changed_is_nothing_written_anew(path: Path) -> None:
    edited(path).save()
    assert path.read_text(encoding="utf-8") == TEXT
    assert [entry.name for entry in path.parent.iterdir()] == ["gym.toml"]


@pytest.mark.parametrize(
    ("name", "key", "value", "old", "new"),
    [
        ("ground", "friction", 0.5, "friction = 0.70  # worn", "friction = 0.5  # worn"),
        ("ground", "height_m", -0.1, "# worn\n", "# worn\nheight_m = -0.1\n"),
        ("seat", "position_m", (1.0, 2.0, 3.0), "[1, 0.5, 0]  # by", "[1.0, 2.0, 3.0]  # by"),
        ("seat", "back", False, "arms = true\n", "arms = true\nback = false\n"),
        ("seat", "arms", None, "arms = true\n", ""),
        ("seat", "back", None, "", ""),
        ("rail", "height_m", 1e-7 + 0.1, "height_m = 0.05", f"height_m = {1e-7 + 0.1!r}"),
    ],
)
def test_a_value_is_changed_where_it_stands(
    path: Path, name: str, key: str, value: object, old: str, new: str
) -> None:
    scene = edited(path)
    scene.set(name, key, value)
    scene.save()
    assert path.read_text(encoding="utf-8") == TEXT.replace(old, new)


def test_an_item_goes_with_the_comment_above_it(path: Path) -> None:
    scene = edited(path)
    scene.remove("seat")
    scene.save()
    first, last = TEXT.index("# Where she"), TEXT.index("# The rail")
    assert path.read_text(encoding="utf-8") == TEXT[:first] + TEXT[last:]


def test_an_item_is_added_at_the_end(path: Path) -> None:
    box = SceneItem("box", "box", (0.0, 1.0, 0.0), {"size_m": (1.0, 1.0, 0.1)})
    scene = edited(path)
    scene.add(box)
    assert scene.names == ["seat", "rail", "box"]
    assert scene.item("box") == box
    assert scene.save().items[-1] == box
    assert path.read_text(encoding="utf-8") == f"{TEXT}\n{scenes.files.dumps_item(box)}"


def test_lines_end_as_they_did(path: Path) -> None:
    scene = edited(path, TEXT.replace("\n", "\r\n"))
    scene.set("ground", "height_m", 0.5)
    scene.save()
    text = path.read_bytes().decode()
    assert text.count("\n") == text.count("\r\n") == TEXT.count("\n") + 1


@pytest.mark.parametrize(
    "text",
    [
        "",
        "# only a comment",
        "ground = { friction = 0.5 }",
        "ground.friction = 0.5",
        '["ground"]\nfriction = 0.5',
        'item = [{ name = "x", kind = "box", position_m = [0, 0, 0], size_m = [1, 1, 1] }]',
        '[[item]]\nname = "x"\nkind = "box"\nposition_m = [0, 0, 0]\nsize_m = [1, 1, 1]',
        '[[item]]\nname = """\\\n  x"""\nkind = "box"\nposition_m = [0, 0, 0]\nsize_m = [1, 1, 1]\n[ground]',
    ],
)
def test_every_valid_file_can_be_changed(path: Path, text: str) -> None:
    before = scenes.parse(text, path)
    scene = edited(path, text)
    box = SceneItem("box", "box", (0.0, 1.0, 0.0), {"size_m": (1.0, 1.0, 0.1)})
    scene.add(box)
    scene.set("ground", "height_m", 0.5)
    scene.set("box", "yaw_rad", 1.5)
    after = scene.save()
    assert after.ground.height_m == 0.5
    assert after.ground.friction == before.ground.friction
    assert after.items[:-1] == before.items
    assert after.items[-1].yaw_rad == 1.5
    assert scenes.read(path) == after


def test_a_mistake_leaves_the_file_as_it_was(path: Path) -> None:
    scene = edited(path)
    scene.set("seat", "arms", 3)
    with pytest.raises(InputError, match="arms must be true or false, found 3"):
        scene.save()
    assert path.read_text(encoding="utf-8") == TEXT
    with pytest.raises(InputError, match="no item 'raul', did you mean 'rail'\\?; there: seat, rail"):
        scene.set("raul", "yaw_rad", 1.0)


comments = st.lists(st.sampled_from(["", "# a", "  # [[item]]", "#"]), max_size=3).map("\n".join)


@given(comments, comments, comments, st.floats(-900, 900), st.integers(0, 2))
def test_comments_anywhere(above: str, between: str, below: str, value: float, which: int) -> None:
    item = '[[item]]\nname = "{}"\nkind = "ball"\nposition_m = [0, 0, 0]\n'
    text = "\n".join((above, item.format(0), between, item.format(1), below, item.format(2)))
    scene = Edited(text)
    scene.set(str(which), "yaw_rad", value)
    content = "".join(scene._blocks)
    assert content.count("#") == text.count("#")
    assert [entry.yaw_rad for entry in scenes.parse(content).items] == [
        value if i == which else 0.0 for i in range(3)
    ]
    lines = content.splitlines()
    lines.remove(f"yaw_rad = {value!r}")
    assert lines == text.splitlines()
