"""`scene.toml` ↔ `Scene`."""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from simrecon.errors import InputError
from simrecon.scene import kinds, meshes
from simrecon.types import Friction, Ground, Scene, SceneItem, Value

FRICTION_KEYS = {
    "friction": "sliding",
    "friction_torsional_m": "torsional_m",
    "friction_rolling_m": "rolling_m",
}
GROUND_KEYS = (
    "height_m",
    *FRICTION_KEYS,
    "slope_rad",
    "slope_yaw_rad",
    "stiffness_Npm",
    "damping_Nspm",
)
REQUIRED_KEYS = ("name", "kind", "position_m")
OPTIONAL_KEYS = ("yaw_rad", *FRICTION_KEYS)
FIT = "fit"
STIFFNESS_RANGE_NPM = (100.0, 1e7)
DAMPING_MAX_NSPM = 1e5
MASS_RANGE_KG = (0.01, 1e5)
SLOPE_MAX_RAD = 1.0
FRICTION_MAX, FRICTION_MAX_M = 10.0, 1.0


def read(path: Path | str) -> Scene:
    """Read a scene file.

    Raises:
        InputError: it can't be read, is not TOML, or holds an unknown key or kind or an impossible value.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: can't read the scene: {error}") from error
    return parse(text, path)


def parse(text: str, path: Path | str = "scene.toml") -> Scene:
    """Read the text of a scene file; `path` is named in errors, and its folder holds the meshes.

    Raises:
        InputError: as `read`.
    """
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not valid TOML: {error}") from error
    return scene(tables, path)


def scene(tables: Mapping[str, Any], path: Path | str) -> Scene:
    """A scene from the tables of its file.

    Raises:
        InputError: as `read`.
    """
    kinds.check_keys(f"{path}:", tables, ("ground", "item"))
    ground = _ground(tables.get("ground", {}), f"{path}: [ground]")
    found = tables.get("item", [])
    if not isinstance(found, list):
        raise InputError(f"{path}: item must be a list of tables, each under [[item]]")
    items = tuple(item(table, f"{path}: item {i + 1}") for i, table in enumerate(found))
    names = [entry.name for entry in items]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{path}: two items are named {name!r}; names must differ")
    folder = str(Path(path).parent)
    for i, entry in enumerate(items):
        if entry.kind == "mesh":
            meshes.check(entry, folder, f"{path}: item {i + 1} ({entry.name})")
    return Scene(ground, items, folder)


def tables(of: Scene) -> dict[str, Any]:
    """The tables of a scene file: what is None is left out; `scene(tables(s), …) == s`."""
    ground: dict[str, Any] = {"height_m": of.ground.height_m, **_friction_keys(of.ground.friction)}
    if of.ground.slope_rad:
        ground |= {"slope_rad": of.ground.slope_rad, "slope_yaw_rad": of.ground.slope_yaw_rad}
    ground |= {
        key: getattr(of.ground, key)
        for key in ("stiffness_Npm", "damping_Nspm")
        if getattr(of.ground, key) is not None
    }
    items = []
    for entry in of.items:
        table: dict[str, Any] = {"name": entry.name, "kind": entry.kind, "position_m": entry.position_m}
        table |= entry.parameters
        table |= {"yaw_rad": entry.yaw_rad, **_friction_keys(entry.friction)}
        items.append(table | ({} if entry.mass_kg is None else {"mass_kg": entry.mass_kg}))
    return {"ground": ground, "item": items}


def dumps(of: Scene) -> str:
    """The text of a scene file; `parse(dumps(scene)) == scene`."""
    found = tables(of)
    lines = ["[ground]", *(f"{key} = {_toml(value)}" for key, value in found["ground"].items())]
    return "\n".join(lines) + "\n" + "".join("\n" + dumps_item(entry) for entry in of.items)


def dumps_item(of: SceneItem) -> str:
    """The text of one item."""
    (table,) = tables(Scene(items=(of,)))["item"]
    return "\n".join(["[[item]]", *(f"{key} = {_toml(value)}" for key, value in table.items())]) + "\n"


def write(of: Scene, path: Path | str) -> None:
    """Write a scene file, first under a temporary name beside it.

    Raises:
        InputError: the file can't be written.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        temporary.write_text(dumps(of), encoding="utf-8")
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise InputError(f"{path}: can't write the scene: {error}") from error


def item_keys(kind: kinds.Kind) -> tuple[str, ...]:
    """All keys that an item of a kind may have."""
    own = tuple(parameter.name for parameter in kind.parameters)
    return (*REQUIRED_KEYS, *own, *OPTIONAL_KEYS, *(("mass_kg",) if kind.movable else ()))


def item(table: Any, where: str) -> SceneItem:
    """One item from its table.

    Raises:
        InputError: as `read`.
    """
    if not isinstance(table, dict):
        raise InputError(f"{where} must be a table under [[item]]")
    name, word = _text(table, "name", where), _text(table, "kind", where)
    where = f"{where} ({name})"
    kind = kinds.kind(word, where)
    if "mass_kg" in table and not kind.movable:
        movable = ", ".join(entry.name for entry in kinds.table().values() if entry.movable)
        raise InputError(f"{where} a {word} can't be moved, so it has no mass_kg; movable: {movable}")
    kinds.check_keys(where, table, item_keys(kind), REQUIRED_KEYS)
    parameters = kinds.parameters(kind, table, where)
    mass = kinds.number(table["mass_kg"], "mass_kg", where, *MASS_RANGE_KG) if "mass_kg" in table else None
    yaw = kinds.number(table.get("yaw_rad", 0.0), "yaw_rad", where, -kinds.LARGEST_M, kinds.LARGEST_M)
    position = kinds.vector(table["position_m"], "position_m", where)
    return SceneItem(name, word, position, parameters, yaw, _friction(table, where), mass)


def _ground(table: Any, where: str) -> Ground:
    if not isinstance(table, dict):
        raise InputError(f"{where} must be a table with the keys {', '.join(GROUND_KEYS)}")
    kinds.check_keys(where, table, GROUND_KEYS)
    if "slope_yaw_rad" in table and "slope_rad" not in table:
        raise InputError(f"{where} slope_yaw_rad needs slope_rad beside it")
    largest = kinds.LARGEST_M

    def given(key: str, low: float, high: float, default: float = 0.0) -> float:
        return kinds.number(table.get(key, default), key, where, low, high)

    stiffness, damping = table.get("stiffness_Npm"), None
    if stiffness is not None and stiffness != FIT:
        if isinstance(stiffness, str):
            raise InputError(f'{where} stiffness_Npm must be a number or "fit", found {stiffness!r}')
        stiffness = given("stiffness_Npm", *STIFFNESS_RANGE_NPM)
        if "damping_Nspm" not in table:
            raise InputError(f"{where} stiffness_Npm needs damping_Nspm beside it, from 0 N·s/m up")
    if "damping_Nspm" in table:
        if not isinstance(stiffness, float):
            raise InputError(
                f"{where} damping_Nspm needs a number stiffness_Npm beside it, found {stiffness!r}"
            )
        damping = given("damping_Nspm", 0.0, DAMPING_MAX_NSPM)
    return Ground(
        given("height_m", -largest, largest),
        _friction(table, where),
        given("slope_rad", 0.0, SLOPE_MAX_RAD),
        given("slope_yaw_rad", -largest, largest),
        stiffness,
        damping,
    )


def _friction(table: Mapping[str, Any], where: str) -> Friction:
    found = {
        field: kinds.number(
            table[key], key, where, 0.0, FRICTION_MAX_M if key.endswith("_m") else FRICTION_MAX
        )
        for key, field in FRICTION_KEYS.items()
        if key in table
    }
    if "rolling_m" in found and "torsional_m" not in found:
        raise InputError(f"{where} friction_rolling_m needs friction_torsional_m beside it")
    return Friction(**found)


def _friction_keys(friction: Friction) -> dict[str, float]:
    values = {key: getattr(friction, field) for key, field in FRICTION_KEYS.items()}
    return {key: value for key, value in values.items() if value is not None}


def _text(table: Mapping[str, Any], key: str, where: str) -> str:
    value = table.get(key)
    if not isinstance(value, str) or not value.strip() or not value.isprintable():
        found = "nothing" if value is None else repr(value)
        raise InputError(f"{where} {key} must be text in quotes, found {found}")
    return value


def _toml(value: Value) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, tuple):
        return "[" + ", ".join(repr(float(entry)) for entry in value) + "]"
    return repr(value)
