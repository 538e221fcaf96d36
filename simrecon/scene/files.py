"""`scene.toml` ↔ `Scene`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from simrecon.errors import InputError
from simrecon.io import atomic, toml
from simrecon.io.messages import check_keys, shown
from simrecon.scene import meshes, schema
from simrecon.types import Scene, SceneItem

ITEMS_MAX = 500
"""More of them take longer than a person to simulate and to draw."""


def read(path: Path | str) -> Scene:
    """Read a scene file.

    Raises:
        InputError: it can't be read, is not TOML, or holds an unknown key or kind or an impossible value.
    """
    return scene(toml.load(path, "scene", any_bytes=True), path)


def parse(text: str, path: Path | str = "scene.toml") -> Scene:
    """Read the text of a scene file; `path` is named in errors, and its folder holds the meshes.

    Raises:
        InputError: as `read`.
    """
    return scene(toml.loads(text, str(path)), path)


def scene(tables: Mapping[str, Any], path: Path | str) -> Scene:
    """A scene from the tables of its file; its meshes are in `folder`, or else beside the file.

    Raises:
        InputError: as `read`.
    """
    check_keys(f"{path}:", tables, ("folder", "ground", "item"))
    own = tables.get("folder", ".")
    if not isinstance(own, str):
        raise InputError(f"{path}: folder must be a path in quotes, found {shown(own)}")
    ground = schema.ground(tables.get("ground", {}), str(path))
    rows = tables.get("item", [])
    if not isinstance(rows, list):
        raise InputError(f"{path}: item must be a list of tables, each under [[item]]")
    if len(rows) > ITEMS_MAX:
        raise InputError(f"{path}: item: found {len(rows)}; valid: at most {ITEMS_MAX}")
    items = tuple(schema.item(table, f"{path}: item {i}") for i, table in enumerate(rows, 1))
    names = [item.name for item in items]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{path}: two items are named {name!r}; names must differ")
    folder = str(Path(path).parent / own)
    for i, item in enumerate(items, 1):
        if item.kind == "mesh":
            meshes.check(item, folder, f"{path}: item {i} ({item.name})")
    return Scene(ground, items, folder)


def tables(scene: Scene) -> dict[str, Any]:
    """The tables of a scene file, without the folder of its meshes; what is None is left out."""
    items = [schema.item_table(item) for item in scene.items]
    return {"ground": schema.ground_table(scene.ground), "item": items}


def dumps(scene: Scene, place: Path | str | None = None) -> str:
    """The text of a scene file, from which `parse` makes an equal scene.

    Args:
        scene: what to write.
        place: folder that the file is for; where its meshes are not there, their folder stands in the text.
    """
    content = tables(scene)
    if not scene.items:
        del content["item"]
    folder = Path(scene.folder).resolve()
    if any(item.kind == "mesh" for item in scene.items) and (
        place is None or folder != Path(place).resolve()
    ):
        content = {"folder": str(folder), **content}
    return toml.dumps(content)


def dumps_item(item: SceneItem) -> str:
    """The text of one item."""
    return toml.dumps({"item": [schema.item_table(item)]})


def write(scene: Scene, path: Path | str) -> None:
    """Write a scene file.

    Raises:
        InputError: the file can't be written.
    """
    with atomic.reported(path):
        atomic.write_text(path, dumps(scene, Path(path).parent))
