"""The scene in the view: the floor, and its items, which can be clicked, moved and turned."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from simrecon.drawing.video import Image
from simrecon.errors import InputError
from simrecon.studio import shapes
from simrecon.studio.clip import Clip
from simrecon.studio.document import Document
from simrecon.studio.gizmo import Gizmos, pose_of
from simrecon.studio.penetration import Inside
from simrecon.types import Array, Ground, Scene, SceneItem

PLAIN, CHOSEN, INSIDE = (176, 141, 98), (214, 170, 92), (205, 58, 48)
FLOOR = "ground"
_GRID_M, _PXPM = 12.0, 80.0


class Furniture:
    """Floor and items of a document, as viser draws them.

    Attributes:
        chosen: name of the item that the handles are at; empty: none.
        gizmos: the handles.
    """

    def __init__(self, view: Any, on_choice: Callable[[str], None]) -> None:
        self._view, self._on_choice = view, on_choice
        self.chosen, self.gizmos = "", Gizmos(view)
        self._frames: dict[str, Any] = {}
        self._meshes: dict[str, Any] = {}
        self._drawn: dict[str, tuple[Any, ...]] = {}
        self._ground: tuple[Any, Any] | None = None

    def draw(self, document: Document, inside: tuple[Inside, ...]) -> None:
        """Draw the scene as it is now; what has not changed stays."""
        scene = document.scene
        deep = {one.name for one in inside}
        self._draw_ground(scene.ground, FLOOR in deep)
        items = {item.name: item for item in scene.items}
        for name in [name for name in self._frames if name not in items]:
            self._forget(name)
        for item in scene.items:
            self._draw_item(item, scene, item.name in deep)
        if self.chosen and self.chosen not in items:
            self.chosen = ""
        self.gizmos.show(document, self.chosen)

    def choose(self, name: str, document: Document, inside: tuple[Inside, ...]) -> None:
        """Put the gizmo at an item; empty: nowhere."""
        self.chosen = name
        self.draw(document, inside)

    def show(self, clip: Clip | None, frame: int, scene: Scene) -> None:
        """Movable items where a motion has them, those that are as they were simulated; others at rest."""
        simulated = {} if clip is None else {item.name: item for item in clip.scene.items}
        for item in scene.items:
            if item.mass_kg is None or self.gizmos.held:
                continue
            moved = clip.moved.get(item.name) if clip is not None else None
            pose = moved[frame] if moved is not None and simulated.get(item.name) == item else pose_of(item)
            self._place(item.name, pose)

    def see_floor(self, visible: bool) -> None:
        """Show the floor, or not: it is in the way of a video behind it."""
        if self._ground is not None:
            self._ground[1].visible = visible

    def reset(self) -> None:
        """Another document: nothing is drawn of the one before."""
        for name in list(self._frames):
            self._forget(name)
        self.chosen = ""
        self.gizmos.show(Document(""), "")

    def _draw_ground(self, ground: Ground, deep: bool) -> None:
        key = (ground, deep)
        if self._ground is not None and self._ground[0] == key:
            return
        colour = (
            (240, 205, 200) if deep else (226, 231, 238) if ground.stiffness_Npm is None else (212, 226, 240)
        )
        half, yaw = ground.slope_rad / 2, ground.slope_yaw_rad
        turn = (math.cos(half), math.sin(half) * math.sin(yaw), -math.sin(half) * math.cos(yaw), 0.0)
        floor = self._view.add_image(
            "/floor",
            floor_image(colour),
            _GRID_M,
            _GRID_M,
            format="png",
            cast_shadow=False,
            receive_shadow=False,
            position=(0.0, 0.0, ground.height_m - 2e-3),
            wxyz=turn,
        )
        self._ground = (key, floor)

    def _draw_item(self, item: SceneItem, scene: Scene, deep: bool) -> None:
        colour = INSIDE if deep else CHOSEN if item.name == self.chosen else PLAIN
        shape = (item.kind, tuple(item.parameters.items()), item.name == self.chosen)
        if self._drawn.get(item.name, (None,))[0] != shape:
            self._forget(item.name)
            self._add(item, scene, colour)
            self._drawn[item.name] = (shape, colour)
        elif self._drawn[item.name][1] != colour:
            self._meshes[item.name].color = colour
            self._drawn[item.name] = (shape, colour)
        self._place(item.name, pose_of(item))

    def _add(self, item: SceneItem, scene: Scene, colour: tuple[int, int, int]) -> None:
        node = f"/items/{_node(item.name)}"
        try:
            mesh = shapes.item_mesh(item, scene.folder)
        except (InputError, ValueError):  # a mesh that can't be used: the panel says so
            mesh = shapes.Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))
        self._frames[item.name] = self._view.add_frame(node, show_axes=False)
        handle = self._view.add_mesh_simple(
            f"{node}/mesh", mesh.vertices_m, mesh.faces, color=colour, flat_shading=True, side="double"
        )
        if item.name != self.chosen:  # the gizmo is in the way of clicks otherwise
            handle.on_click(lambda _: self._on_choice(item.name))
        self._meshes[item.name] = handle

    def _place(self, name: str, pose: Array) -> None:
        frame = self._frames[name]
        frame.position, frame.wxyz = pose[:3], pose[3:]

    def _forget(self, name: str) -> None:
        if name in self._frames:
            self._frames.pop(name).remove()
            self._meshes.pop(name)
            self._drawn.pop(name, None)


def floor_image(colour: tuple[int, int, int]) -> Image:
    """A floor as a picture, which is drawn faster than lines: lines each metre, finer ones each 25 cm."""
    size = int(_GRID_M * _PXPM)
    image = np.full((size, size, 3), colour, np.uint8)
    for each_m, darker, wide in ((0.25, 12, 1), (1.0, 48, 2)):
        shade = np.array(colour, np.int64) - darker
        for line in np.arange(0, size, each_m * _PXPM).astype(int):
            image[line : line + wide] = image[:, line : line + wide] = shade
    return image


def _node(name: str) -> str:
    """A name as viser's tree can hold it."""
    return "".join(letter if letter.isalnum() else f"-{ord(letter):x}-" for letter in name)
