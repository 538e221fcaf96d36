"""Tables of a scene file, and what they stand for; parameters of items are data, see `scene.kinds`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

from simrecon.errors import InputError
from simrecon.io import tables
from simrecon.io.messages import check_keys, shown
from simrecon.io.tables import number, option, text
from simrecon.scene import kinds
from simrecon.scene.kinds import LARGEST_M
from simrecon.types import Friction, Ground, SceneItem

FIT: Final = "fit"
"""As a floor's stiffness: it is fitted to the clip."""
STIFFNESS_RANGE_NPM = (100.0, 1e7)
DAMPING_MAX_NSPM = 1e5
MASS_RANGE_KG = (0.01, 1e5)
SLOPE_MAX_RAD = 1.0
FRICTION_MAX, FRICTION_MAX_M = 10.0, 1.0
REQUIRED_KEYS = ("name", "kind", "position_m")


@dataclass(frozen=True, kw_only=True)
class GroundTable:
    """`[ground]`."""

    height_m: float = number(-LARGEST_M, LARGEST_M, 0.0)
    friction: float = number(0.0, FRICTION_MAX, Friction().sliding)
    friction_torsional_m: float | None = number(0.0, FRICTION_MAX_M, None)
    friction_rolling_m: float | None = number(0.0, FRICTION_MAX_M, None)
    slope_rad: float | None = number(0.0, SLOPE_MAX_RAD, None)
    slope_yaw_rad: float | None = number(-LARGEST_M, LARGEST_M, None)
    stiffness_Npm: float | Literal["fit"] | None = number(*STIFFNESS_RANGE_NPM, None)
    damping_Nspm: float | None = number(0.0, DAMPING_MAX_NSPM, None)


@dataclass(frozen=True, kw_only=True)
class ItemTable:
    """`[[item]]` without the parameters of its kind, which come after the position."""

    name: str = text()
    kind: str = text()
    position_m: tuple[float, float, float] = option(above=-LARGEST_M, high=LARGEST_M)
    yaw_rad: float = number(-LARGEST_M, LARGEST_M, 0.0)
    friction: float = number(0.0, FRICTION_MAX, Friction().sliding)
    friction_torsional_m: float | None = number(0.0, FRICTION_MAX_M, None)
    friction_rolling_m: float | None = number(0.0, FRICTION_MAX_M, None)
    mass_kg: float | None = number(*MASS_RANGE_KG, None)


def ground(table: Any, where: str) -> Ground:
    """The floor from its table; `where` is the file, for messages.

    Raises:
        InputError: an unknown or impossible value.
    """
    values = tables.build(GroundTable, table, where, section="ground")
    where, stiffness, damping = f"{where}: [ground]", values.stiffness_Npm, values.damping_Nspm
    if values.slope_yaw_rad is not None and values.slope_rad is None:
        raise InputError(f"{where} slope_yaw_rad needs slope_rad beside it")
    if isinstance(stiffness, float) and damping is None:
        raise InputError(f"{where} stiffness_Npm needs damping_Nspm beside it, from 0 N·s/m up")
    if damping is not None and not isinstance(stiffness, float):
        raise InputError(f"{where} damping_Nspm needs a number stiffness_Npm beside it, found {stiffness!r}")
    return Ground(
        values.height_m,
        _friction(values, where),
        values.slope_rad or 0.0,
        values.slope_yaw_rad or 0.0,
        stiffness if isinstance(stiffness, float) else None,
        damping,
        calibrate=stiffness == FIT,
    )


def ground_table(ground: Ground) -> dict[str, Any]:
    """The table of a floor; keys that are None are left out."""
    sloped = bool(ground.slope_rad)
    values = GroundTable(
        height_m=ground.height_m,
        slope_rad=ground.slope_rad if sloped else None,
        slope_yaw_rad=ground.slope_yaw_rad if sloped else None,
        stiffness_Npm=FIT if ground.calibrate else ground.stiffness_Npm,
        damping_Nspm=None if ground.calibrate else ground.damping_Nspm,
        **_friction_keys(ground.friction),
    )
    return tables.to_table(values)


def item(table: Any, where: str) -> SceneItem:
    """An item from its table; `where` is the file and which item it is, for messages.

    Raises:
        InputError: an unknown, missing or impossible value.
    """
    if not isinstance(table, Mapping):
        raise InputError(f"{where} must be a table under [[item]], found {shown(table)}")
    known = tables.keys(ItemTable)
    name, word = (tables.check(known[key], table.get(key), where) for key in ("name", "kind"))
    where = f"{where} ({name})"
    kind = kinds.kind(word, where)
    if "mass_kg" in table and not kind.movable:
        movable = ", ".join(entry.name for entry in kinds.table().values() if entry.movable)
        raise InputError(f"{where} a {word} cannot be moved, so it has no mass_kg; movable: {movable}")
    check_keys(where, table, _item_keys(kind), REQUIRED_KEYS)
    parameters = kinds.parameters(kind, table, where)
    common = {key: value for key, value in table.items() if key not in parameters}
    values = tables.build(ItemTable, common, where)
    friction = _friction(values, where)
    return SceneItem(name, word, values.position_m, parameters, values.yaw_rad, friction, values.mass_kg)


def item_table(item: SceneItem) -> dict[str, Any]:
    """The table of an item; keys that are None are left out."""
    values = ItemTable(
        name=item.name,
        kind=item.kind,
        position_m=item.position_m,
        yaw_rad=item.yaw_rad,
        mass_kg=item.mass_kg,
        **_friction_keys(item.friction),
    )
    table = tables.to_table(values)
    parameters: dict[str, Any] = tables.plain(item.parameters)
    return {key: table[key] for key in REQUIRED_KEYS} | parameters | table


def _item_keys(kind: kinds.Kind) -> tuple[str, ...]:
    """All keys that an item of a kind may have."""
    own = [parameter.name for parameter in kind.parameters]
    others = [key for key in tables.keys(ItemTable) if key not in REQUIRED_KEYS]
    return tuple(key for key in (*REQUIRED_KEYS, *own, *others) if key != "mass_kg" or kind.movable)


def _friction(table: GroundTable | ItemTable, where: str) -> Friction:
    if table.friction_rolling_m is not None and table.friction_torsional_m is None:
        raise InputError(f"{where} friction_rolling_m needs friction_torsional_m beside it")
    return Friction(table.friction, table.friction_torsional_m, table.friction_rolling_m)


def _friction_keys(friction: Friction) -> dict[str, Any]:
    return {
        "friction": friction.sliding,
        "friction_torsional_m": friction.torsional_m,
        "friction_rolling_m": friction.rolling_m,
    }
