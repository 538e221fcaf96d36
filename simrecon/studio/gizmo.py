"""The handles of the chosen item: arrows and a ring that move and turn it, a corner that makes it larger."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from simrecon.scene import kinds
from simrecon.studio import placing
from simrecon.studio.document import Document
from simrecon.studio.latest import Latest
from simrecon.types import Array, Scene, SceneItem

_LONG = ("beam", "table", "bed", "ramp", "mat", "trampoline")
SIDES: Mapping[str, tuple[str, str, str]] = {
    "chair": ("seat_depth_m", "seat_width_m", "seat_height_m"),
    "wall": ("thickness_m", "length_m", "height_m"),
    **dict.fromkeys(_LONG, ("length_m", "width_m", "height_m")),
}
"""Measures along x, y and z of kinds; the corner is half of the first two, and the third, away."""


class Gizmos:
    """The handles, as viser draws them.

    Attributes:
        snap: to centimetres and to 5°; floor: items stay on the floor.
        held: whether one of them is being dragged.
    """

    def __init__(self, view: Any) -> None:
        self._view = view
        self.snap = self.floor = True
        self.held = False
        self._document: Document | None = None
        self._name = ""
        self._place: Any = None
        self._corner: Any = None
        self._follow_place = Latest(lambda: self._edit(self._place, self._moved))
        self._follow_corner = Latest(lambda: self._edit(self._corner, self._sized))

    def show(self, document: Document, name: str) -> None:
        """Put them at an item; empty: nowhere."""
        self._document, self._name = document, name
        if not name:
            self._hide()
        elif not self.held:
            item = document.item(name)
            self._show_place(item)
            self._show_corner(item)

    def _show_place(self, item: SceneItem) -> None:
        if self._place is None:
            self._place = self._view.add_transform_controls(
                "/gizmo", scale=0.7, rotation_limits=((0, 0), (0, 0), (-10.0, 10.0)), depth_test=False
            )
            self._place.on_update(lambda event: self._dragged(event, self._follow_place))
        pose = pose_of(item)
        self._place.position, self._place.wxyz = pose[:3], pose[3:]

    def _show_corner(self, item: SceneItem) -> None:
        corner = corner_of(item)
        if corner is None:
            if self._corner is not None:
                self._corner.visible = False
            return
        if self._corner is None:
            self._corner = self._view.add_transform_controls(
                "/corner", scale=0.25, disable_rotations=True, disable_sliders=True, depth_test=False
            )
            self._corner.on_update(lambda event: self._dragged(event, self._follow_corner))
        self._corner.visible = True
        self._corner.position, self._corner.wxyz = corner, pose_of(item)[3:]

    def _hide(self) -> None:
        for handle in (self._place, self._corner):
            if handle is not None:
                handle.remove()
        self._place = self._corner = None

    def _dragged(self, event: Any, follow: Latest) -> None:
        """A handle was grabbed, moved or let go."""
        if event.phase == "start":
            self.held = True
        follow.ask()
        if event.phase == "end" and self._document is not None:
            self.held = False
            self._document.settle()
            self.show(self._document, self._name)

    def _edit(self, handle: Any, keys: Any) -> None:
        """What a handle says: an edit, which is one to undo until it is let go."""
        document = self._document
        if document is None or handle is None or not self._name:
            return
        item = document.item(self._name)
        values = keys(item, document.scene, handle)
        if values:
            document.set(item.name, values, merge="drag")

    def _moved(self, item: SceneItem, scene: Scene, handle: Any) -> Mapping[str, Any]:
        return moved(item, scene, handle.position, handle.wxyz, self.snap, self.floor)

    def _sized(self, item: SceneItem, _: Scene, handle: Any) -> Mapping[str, Any]:
        return sized(item, handle.position, self.snap)


def moved(
    item: SceneItem, scene: Scene, position_m: Any, turn: Any, snap: bool, floor: bool
) -> Mapping[str, Any]:
    """Keys of an item that a place (3,) and an orientation (4,) of the gizmo change."""
    x, y, z = (float(value) for value in position_m)
    yaw = 2 * math.atan2(float(turn[3]), float(turn[0]))
    if snap:
        (x, y, z), yaw = placing.snapped_place((x, y, z)), placing.snapped_turn(yaw)
    if floor:
        z = placing.on_floor(scene, x, y)
    values: dict[str, Any] = {}
    if np.abs(np.subtract((x, y, z), item.position_m)).max() > 1e-6:
        values["position_m"] = [round(x, 4), round(y, 4), round(z, 4)]
    if abs(math.remainder(yaw - item.yaw_rad, 2 * math.pi)) > 1e-3:
        values["yaw_rad"] = round(math.remainder(yaw, 2 * math.pi), 4)
    return values


def sized(item: SceneItem, corner_m: Any, snap: bool) -> Mapping[str, Any]:
    """Keys of an item that a place (3,) of its corner changes; measures stay within those of the kind."""
    before = _measures(item)
    if before is None:
        return {}
    local = _turned(np.asarray(corner_m, float) - item.position_m, -item.yaw_rad)
    wanted = np.maximum(local * (2.0, 2.0, 1.0), placing.STEP_M)
    if snap:
        wanted = np.array([placing.snapped(value, placing.STEP_M) for value in wanted])
    rules = {parameter.name: parameter for parameter in kinds.table()[item.kind].parameters}
    names = SIDES.get(item.kind)
    if names is None:
        size = [round(float(value), 4) for value in wanted]
        return {} if np.allclose(size, before) else {"size_m": size}
    clipped = [float(np.clip(v, rules[n].low, rules[n].high)) for n, v in zip(names, wanted, strict=True)]
    return {n: round(v, 4) for n, v, b in zip(names, clipped, before, strict=True) if abs(v - b) > 1e-4}


def corner_of(item: SceneItem) -> Array | None:
    """Where the corner handle of an item is (3,); None of a kind that has none."""
    measures = _measures(item)
    if measures is None:
        return None
    return np.asarray(item.position_m) + _turned(measures * (0.5, 0.5, 1.0), item.yaw_rad)


def _measures(item: SceneItem) -> Array | None:
    """Along x, y and z (3,)."""
    values: Any = item.parameters
    if item.kind == "box":
        return np.array(values["size_m"], float)
    names = SIDES.get(item.kind)
    return None if names is None else np.array([values[name] for name in names], float)


def _turned(vector_m: Array, yaw_rad: float) -> Array:
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]) @ vector_m


def pose_of(item: SceneItem) -> Array:
    """Place and orientation of an item at rest (7,)."""
    half = item.yaw_rad / 2
    return np.array([*item.position_m, math.cos(half), 0.0, 0.0, math.sin(half)])
