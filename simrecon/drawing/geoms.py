"""The geoms of a model that are drawn: which are the person, items and ground, and their colours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from simrecon import scene as scenes
from simrecon.drawing.canvas import Colour
from simrecon.types import Array

# Colours are blue, green, red.
LEFT, RIGHT, CENTRE, _ITEM = (48, 134, 240), (172, 152, 36), (196, 192, 188), (150, 176, 200)
QUADS_MAX = 60_000
_PLAIN_RGBA = (0.5, 0.5, 0.5, 1.0)  # MuJoCo's default


@dataclass(frozen=True, eq=False)
class Geoms:
    """Those of a model that are not transparent, by their ids.

    Attributes:
        person: what moves and is no item.
        items: all that is neither person nor ground.
        grounds: planes first.
        boxes: those of the items.
        colours: (G, 3) blue, green, red of all geoms of the model.
    """

    person: list[int]
    items: list[int]
    grounds: list[int]
    boxes: list[int]
    colours: Array


def of_model(model: mujoco.MjModel) -> Geoms:
    """Sort the geoms of a model: those that don't move and those named `item/...` are scene."""
    names = [model.geom(i).name or model.body(model.geom_bodyid[i]).name for i in range(model.ngeom)]
    moving = model.body_weldid[model.geom_bodyid] != 0
    shown = [i for i in range(model.ngeom) if model.geom_rgba[i, 3] > 0]
    person = [i for i in shown if moving[i] and not names[i].startswith(scenes.ITEM_PREFIX)]
    flat = [i for i in shown if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_PLANE]
    grounds = flat + [i for i in shown if names[i] == scenes.GROUND_GEOM and i not in flat]
    person = [i for i in person if i not in grounds]
    items = [i for i in shown if i not in {*person, *grounds}]
    boxes = [i for i in items if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_BOX]
    colours = np.array([_side_colour(name) for name in names], float)
    colours[items] = _ITEM
    painted = [i for i in items if not np.allclose(model.geom_rgba[i], _PLAIN_RGBA)]
    colours[painted] = 255 * model.geom_rgba[painted, 2::-1]
    return Geoms(person, items, grounds, boxes, colours)


def _side_colour(name: str) -> Colour:
    words = name.lower().replace(".", "_").replace("-", "_").replace("/", "_").split("_")
    if "left" in words or "l" in words:
        return LEFT
    return RIGHT if "right" in words or "r" in words else CENTRE


def coarse_cell_m(model: mujoco.MjModel, items: Sequence[int], finest_m: float) -> float:
    """A cell size, not below one, that keeps large scenes and many items at some thousand quads."""
    boxes = [i for i in items if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_BOX]
    if not boxes:
        return finest_m
    edges = 2 * model.geom_size[boxes]  # (B, 3)
    cell = max(finest_m, float(edges.max()) / 60)
    while _quads(edges, cell) > max(QUADS_MAX, 6 * len(boxes)):
        cell *= 1.5
    return cell


def _quads(edges_m: Array, cell_m: float) -> float:
    """How many quads the faces of boxes (B, 3) have."""
    cells = np.ceil(edges_m / cell_m)
    return float(2 * (cells * np.roll(cells, 1, axis=1)).sum())
