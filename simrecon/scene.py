"""Floor and fixed things of `scene.toml`, and the MJCF of a person among them."""

from __future__ import annotations

import difflib
import json
import math
import os
import tomllib
import xml.etree.ElementTree as ElementTree
from collections.abc import Collection, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from simrecon.errors import InputError
from simrecon.types import Array, Ground, Scene, SceneItem

GROUND_GEOM = "ground"
ITEM_PREFIX = "item/"

# Torsional and rolling friction, metres; MuJoCo's defaults (documentation, XML reference, geom/friction).
_SPIN_FRICTION_M, _ROLL_FRICTION_M = 0.005, 0.0001

_SIZE_KEYS = {"box": ("size_m",), "beam": ("length_m", "width_m", "height_m")}
_COMMON_KEYS = ("name", "kind", "position_m", "yaw_rad", "friction")
_OPTIONAL_KEYS = ("yaw_rad", "friction")
_GROUND_KEYS = ("height_m", "friction")
_LATER_KINDS = ("chair", "table", "bed", "stairs", "trampoline", "mesh")
_LATER_GROUND_KEYS = ("stiffness_Npm", "damping_Nspm")
_LARGEST_M = 1000.0


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
    """Read the text of a scene file; `path` is named in errors.

    Raises:
        InputError: as `read`.
    """
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not valid TOML: {error}") from error
    _check_keys(f"{path}:", tables, ("ground", "item"))
    ground = _ground(tables.get("ground", {}), f"{path}: [ground]")
    found = tables.get("item", [])
    if not isinstance(found, list):
        raise InputError(f"{path}: item must be a list of tables, each under [[item]]")
    items = tuple(_item(table, f"{path}: item {i + 1}") for i, table in enumerate(found))
    names = [item.name for item in items]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{path}: two items are named {name!r}; names must differ")
    return Scene(ground, items)


def dumps(scene: Scene) -> str:
    """The text of a scene file; `parse(dumps(scene)) == scene`."""
    lines = ["[ground]", *(f"{key} = {float(value)!r}" for key, value in asdict(scene.ground).items())]
    for item in scene.items:
        lines += ["", "[[item]]"]
        lines += [f"{key} = {json.dumps(getattr(item, key), ensure_ascii=False)}" for key in ("name", "kind")]
        lines.append(f"position_m = {_vector_text(item.position_m)}")
        if item.kind == "beam":
            sizes = zip(_SIZE_KEYS["beam"], item.size_m, strict=True)
            lines += [f"{key} = {float(size)!r}" for key, size in sizes]
        else:
            lines.append(f"size_m = {_vector_text(item.size_m)}")
        lines += [f"yaw_rad = {float(item.yaw_rad)!r}", f"friction = {float(item.friction)!r}"]
    return "\n".join(lines) + "\n"


def write(scene: Scene, path: Path | str) -> None:
    """Write a scene file, first under a temporary name beside it.

    Raises:
        InputError: the file can't be written.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        temporary.write_text(dumps(scene), encoding="utf-8")
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise InputError(f"{path}: can't write the scene: {error}") from error


def build(body_mjcf: str, scene: Scene, timestep_s: float) -> str:
    """MJCF of a person in a scene; it loads alone.

    Options come from the body's MJCF, apart from the time step, which keeps all its digits. Contacts with the
    scene take the scene's friction (priority 1): MuJoCo would otherwise use the larger one of the two geoms.
    The scene's solref and solimp are those of the main default class of the body's MJCF.

    Args:
        body_mjcf: the person alone.
        scene: floor and things.
        timestep_s: of the simulation.
    """
    spec = mujoco.MjSpec.from_string(body_mjcf)
    geom = {"contype": 1, "conaffinity": 1, "condim": 3, "priority": 1}
    spec.worldbody.add_geom(
        name=GROUND_GEOM,
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=[0.0, 0.0, scene.ground.height_m],
        size=[0.0, 0.0, 0.05],
        friction=[scene.ground.friction, _SPIN_FRICTION_M, _ROLL_FRICTION_M],
        **geom,
    )
    for item in scene.items:
        x, y, z = item.position_m
        spec.worldbody.add_geom(
            name=ITEM_PREFIX + item.name,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=[x, y, z + item.size_m[2] / 2],
            quat=[math.cos(item.yaw_rad / 2), 0.0, 0.0, math.sin(item.yaw_rad / 2)],
            size=[length / 2 for length in item.size_m],
            friction=[item.friction, _SPIN_FRICTION_M, _ROLL_FRICTION_M],
            **geom,
        )
    spec.option.timestep = timestep_s
    spec.compile()
    return _with_timestep(spec.to_xml(), timestep_s)


def support_height(scene: Scene, xy_m: Array) -> Array:
    """Height of the highest support under points: the top of an item, or the ground.

    Args:
        scene: floor and things.
        xy_m: (..., 2) horizontal positions.

    Returns:
        (...) heights in metres.
    """
    height = np.full(xy_m.shape[:-1], float(scene.ground.height_m))
    for item in scene.items:
        cos, sin = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
        local = (xy_m - np.array(item.position_m[:2])) @ np.array([[cos, -sin], [sin, cos]])  # (..., 2)
        inside = (np.abs(local) <= np.array(item.size_m[:2]) / 2).all(axis=-1)  # (...)
        height = np.where(inside, np.maximum(height, item.position_m[2] + item.size_m[2]), height)
    return height


def distances(scene: Scene, points_m: Array) -> tuple[Array, Array]:
    """Signed distance of points to the ground and to each item, negative inside, and its gradient.

    Items count as reaching down without end: nothing gets under them.

    Args:
        scene: floor and things.
        points_m: (..., 3).

    Returns:
        (1 + items, ...) distances in metres and (1 + items, ..., 3) unit gradients.
    """
    found = [points_m[..., 2] - scene.ground.height_m]
    normals = [np.broadcast_to([0.0, 0.0, 1.0], points_m.shape)]
    for item in scene.items:
        cos, sin = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
        turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])  # item → world
        x, y, z = item.position_m
        local = (points_m - np.array([x, y, z + item.size_m[2]])) @ turn  # (..., 3) from its top
        half = np.array([item.size_m[0] / 2, item.size_m[1] / 2, 0.0])
        sign = np.where(local < 0, -1.0, 1.0) * [1.0, 1.0, 0.0] + [0.0, 0.0, 1.0]
        beyond = local * sign - half  # (..., 3) distance past each face
        outside = np.maximum(beyond, 0.0)
        far = np.linalg.norm(outside, axis=-1)
        nearest = np.argmax(beyond, axis=-1)
        inward = sign * np.eye(3)[nearest]
        outward = sign * outside / np.maximum(far, 1e-12)[..., None]
        found.append(np.where(far > 0, far, beyond.max(axis=-1)))
        normals.append(np.where(far[..., None] > 0, outward, inward) @ turn.T)
    return np.stack(found), np.stack(normals)


def _with_timestep(mjcf: str, timestep_s: float) -> str:
    """Put the time step back in full: MuJoCo prints six digits."""
    root = ElementTree.fromstring(mjcf)
    option = root.find("option")
    if option is None:
        option = ElementTree.SubElement(root, "option")
    option.set("timestep", repr(float(timestep_s)))
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _ground(table: Any, where: str) -> Ground:
    if not isinstance(table, dict):
        raise InputError(f"{where} must be a table with the keys {', '.join(_GROUND_KEYS)}")
    later = [key for key in table if key in _LATER_GROUND_KEYS]
    if later:
        valid = ", ".join(_GROUND_KEYS)
        raise InputError(f"{where} {later[0]} is not supported yet; supported keys: {valid}")
    _check_keys(where, table, _GROUND_KEYS)
    ground = Ground()
    if "height_m" in table:
        ground = replace(ground, height_m=_number(table, "height_m", where, -_LARGEST_M, _LARGEST_M))
    if "friction" in table:
        ground = replace(ground, friction=_number(table, "friction", where, 0.0, 10.0))
    return ground


def _item(table: Any, where: str) -> SceneItem:
    if not isinstance(table, dict):
        raise InputError(f"{where} must be a table under [[item]]")
    name, kind = _text(table, "name", where), _text(table, "kind", where)
    where = f"{where} ({name})"
    valid = ", ".join(_SIZE_KEYS)
    if kind in _LATER_KINDS:
        raise InputError(f"{where} kind {kind!r} is not supported yet; supported kinds: {valid}")
    if kind not in _SIZE_KEYS:
        raise InputError(f"{where} kind {kind!r} is unknown{_hint(kind, _SIZE_KEYS)}; valid: {valid}")
    keys = (*_COMMON_KEYS[:3], *_SIZE_KEYS[kind], *_OPTIONAL_KEYS)
    _check_keys(where, table, keys, required=[key for key in keys if key not in _OPTIONAL_KEYS])
    if kind == "box":
        size = _vector(table, "size_m", where, above=0.0)
    else:
        lengths = (_number(table, key, where, 0.0, _LARGEST_M, True) for key in _SIZE_KEYS[kind])
        length, width, height = lengths
        size = (length, width, height)
    item = SceneItem(name, kind, _vector(table, "position_m", where), size)
    if "yaw_rad" in table:
        item = replace(item, yaw_rad=_number(table, "yaw_rad", where, -_LARGEST_M, _LARGEST_M))
    if "friction" in table:
        item = replace(item, friction=_number(table, "friction", where, 0.0, 10.0))
    return item


def _check_keys(
    where: str, table: Mapping[str, Any], valid: Collection[str], required: Collection[str] = ()
) -> None:
    for key in table:
        if key not in valid:
            hint = _hint(key, valid)
            raise InputError(f"{where} unknown key {key!r}{hint}; valid: {', '.join(valid)}")
    for key in required:
        if key not in table:
            raise InputError(f"{where} lacks the key {key!r}; needed: {', '.join(required)}")


def _hint(word: str, valid: Collection[str]) -> str:
    close = difflib.get_close_matches(word, valid, n=1)
    return f", did you mean {close[0]!r}?" if close else ""


def _text(table: Mapping[str, Any], key: str, where: str) -> str:
    value = table.get(key)
    if not isinstance(value, str) or not value.strip() or not value.isprintable():
        found = "nothing" if value is None else repr(value)
        raise InputError(f"{where} {key} must be text in quotes, found {found}")
    return value


def _number(
    table: Mapping[str, Any], key: str, where: str, low: float, high: float, above: bool = False
) -> float:
    value = _as_float(table[key])
    if value is None or not low <= value <= high or (above and value == low):
        rule = f"above {low:g} and at most {high:g}" if above else f"from {low:g} to {high:g}"
        raise InputError(f"{where} {key} must be a number {rule}, found {table[key]!r}")
    return value


def _vector(
    table: Mapping[str, Any], key: str, where: str, above: float = -_LARGEST_M
) -> tuple[float, float, float]:
    found = table[key]
    values = [_as_float(value) for value in found] if isinstance(found, list) else []
    numbers = [value for value in values if value is not None and above < value <= _LARGEST_M]
    if len(values) != 3 or len(numbers) != 3:
        rule = f"above {above:g} and at most {_LARGEST_M:g}"
        raise InputError(f"{where} {key} must be three numbers [x, y, z] {rule}, found {found!r}")
    return numbers[0], numbers[1], numbers[2]


def _as_float(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e300:
        return None
    return float(value)


def _vector_text(values: tuple[float, float, float]) -> str:
    return "[" + ", ".join(repr(float(value)) for value in values) + "]"
