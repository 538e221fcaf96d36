"""Rigid parts of the kinds of items that are described by their measures (models/scene/kinds.toml)."""

from __future__ import annotations

from typing import Any

import numpy as np

from simrecon.scene.parts import Part, block, hull, standing


def build(kind: str, values: dict[str, Any]) -> list[Part]:
    """The rigid parts of an item.

    Args:
        kind: any kind but `mesh`.
        values: all parameters of the kind.

    Returns:
        Parts in the item's frame; none of a mat, which is a sheet only.
    """
    return [] if kind == "mat" else _BUILDERS[kind](values)


def _box(values: dict[str, Any]) -> list[Part]:
    return [standing(*values["size_m"])]


def _beam(values: dict[str, Any]) -> list[Part]:
    return [standing(values["length_m"], values["width_m"], values["height_m"])]


def _wall(values: dict[str, Any]) -> list[Part]:
    return [standing(values["thickness_m"], values["length_m"], values["height_m"])]


def _ball(values: dict[str, Any]) -> list[Part]:
    radius = values["radius_m"]
    return [Part("", "sphere", np.array([0.0, 0.0, radius]), np.full(3, radius))]


def _ramp(values: dict[str, Any]) -> list[Part]:
    x, y, z = values["length_m"] / 2, values["width_m"] / 2, values["height_m"]
    corners = [(sx * x, sy * y, 0.0) for sx in (-1, 1) for sy in (-1, 1)]
    return [hull("", np.array([*corners, (x, -y, z), (x, y, z)]))]


def _stairs(values: dict[str, Any]) -> list[Part]:
    count, rise, run, y = values["steps"], values["rise_m"], values["run_m"], values["width_m"] / 2
    start = -count * run / 2
    return [
        block(f"step_{i + 1}", (start + i * run, -y, 0.0), (start + (i + 1) * run, y, (i + 1) * rise), True)
        for i in range(count)
    ]


def _legs(x: float, y: float, leg: float, height: float) -> list[Part]:
    """Four legs of width `leg` at the corners of a rectangle x by y."""
    names = {(1, 1): "front_left", (1, -1): "front_right", (-1, 1): "rear_left", (-1, -1): "rear_right"}
    legs = []
    for (sx, sy), name in names.items():
        cx, cy = sx * (x - leg) / 2, sy * (y - leg) / 2
        low, high = (cx - leg / 2, cy - leg / 2, 0.0), (cx + leg / 2, cy + leg / 2, height)
        legs.append(block(f"leg_{name}", low, high))
    return legs


def _table(values: dict[str, Any]) -> list[Part]:
    x, y, under = values["length_m"], values["width_m"], values["height_m"] - values["top_m"]
    top = block("top", (-x / 2, -y / 2, under), (x / 2, y / 2, values["height_m"]))
    return [top, *_legs(x, y, values["leg_m"], under)]


def _chair(values: dict[str, Any]) -> list[Part]:
    x, y, top, thick, leg = (
        values[key] for key in ("seat_depth_m", "seat_width_m", "seat_height_m", "seat_m", "leg_m")
    )
    parts = [
        block("seat", (-x / 2, -y / 2, top - thick), (x / 2, y / 2, top)),
        *_legs(x, y, leg, top - thick),
    ]
    if values["back"]:
        high = top + values["back_height_m"]
        parts.append(block("back", (-x / 2 - thick, -y / 2, top), (-x / 2, y / 2, high)))
    if values["arms"]:
        over = top + values["arm_height_m"]
        for sign, side in ((1, "left"), (-1, "right")):
            inner, outer = sorted((sign * y / 2, sign * (y / 2 + leg)))
            parts.append(block(f"arm_{side}", (-x / 2, inner, over - leg), (x / 2, outer, over)))
            parts.append(block(f"post_{side}", (x / 2 - leg, inner, top - thick), (x / 2, outer, over - leg)))
    return parts


def _bed(values: dict[str, Any]) -> list[Part]:
    height = values["height_m"]
    if values["stiffness_Npm3"] > 0:  # the mattress on it is a sheet
        height = max(height - values["mattress_m"], 0.01)
    return [standing(values["length_m"], values["width_m"], height)]


def _trampoline_frame(values: dict[str, Any]) -> list[Part]:
    x, y, top, wide = values["length_m"] / 2, values["width_m"] / 2, values["height_m"], values["frame_m"]
    low, leg = top - 0.06, 0.06
    pads = [
        block("pad_front", (x, -y - wide, low), (x + wide, y + wide, top)),
        block("pad_rear", (-x - wide, -y - wide, low), (-x, y + wide, top)),
        block("pad_left", (-x, y, low), (x, y + wide, top)),
        block("pad_right", (-x, -y - wide, low), (x, -y, top)),
    ]
    return [*pads, *_legs(2 * (x + wide), 2 * (y + wide), leg, low)]


_BUILDERS = {
    "box": _box,
    "beam": _beam,
    "table": _table,
    "chair": _chair,
    "bed": _bed,
    "stairs": _stairs,
    "wall": _wall,
    "ball": _ball,
    "ramp": _ramp,
    "trampoline": _trampoline_frame,
}
