"""Floor and items of a model as triangles, piece by piece: what belongs together, in one colour."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from simrecon import scene as scenes
from simrecon.drawing import geoms as drawn
from simrecon.drawing import shapes
from simrecon.geometry import rotations
from simrecon.types import Array, IntArray, Scene

GROUND_RGB = np.array([0.80, 0.82, 0.84])
_MARGIN_M = 2.0
"""Of the floor, around all that moves and stands on it."""
_ROUND = (mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_ELLIPSOID)
_CELL_M = 1e3


@dataclass(frozen=True, eq=False)
class Piece:
    """Geoms of one colour and one body that belong to one item.

    Attributes:
        name: of the item, or `ground`.
        body: id of the body.
        rgb: (3,) 0 to 1.
        points_m: (V, 3) in the frame of the body.
        faces: (F, 3), counter-clockwise seen from outside.
    """

    name: str
    body: int
    rgb: Array
    points_m: Array
    faces: IntArray


def of_scene(model: mujoco.MjModel, scene: Scene, around_m: Array) -> Iterator[Piece]:
    """What floor and items consist of.

    Args:
        model: of person and scene.
        scene: whose items give the names.
        around_m: (N, 2) points that the floor reaches around, beside the items.
    """
    shown = drawn.of_model(model)
    groups: dict[tuple[str, int, bytes], list[int]] = {}
    for geom in shown.items:
        name = scenes.owner(model.geom(geom).name, scene) or model.geom(geom).name or "item"
        rgb = shown.colours[geom, ::-1] / 255
        groups.setdefault((name, int(model.geom_bodyid[geom]), rgb.tobytes()), []).append(geom)
    for geom in shown.grounds[:1]:
        places = [around_m, *(np.array(item.position_m)[None, :2] for item in scene.items)]
        body = int(model.geom_bodyid[geom])
        yield Piece(scenes.GROUND_GEOM, body, GROUND_RGB, *_floor(model, geom, np.concatenate(places)))
    for (name, body, rgb_bytes), members in groups.items():
        points_m, faces = _triangles(model, members)
        if len(faces):
            yield Piece(name, body, np.frombuffer(rgb_bytes), points_m, faces)


def _triangles(model: mujoco.MjModel, geoms: list[int]) -> tuple[Array, IntArray]:
    """Triangles of geoms in the frame of their body; those of flat sides have corners of their own."""
    points, faces, count = [], [], 0
    for geom in geoms:
        surface = shapes.surface(model, [geom], _CELL_M)
        local, triangles = surface.vertices_m, shapes.triangles(surface.faces)
        if model.geom_type[geom] not in _ROUND:
            local, triangles = local[triangles].reshape(-1, 3), np.arange(triangles.size).reshape(-1, 3)
        turn = rotations.matrix(model.geom_quat[geom])
        points.append(local @ turn.T + model.geom_pos[geom])
        faces.append(triangles + count)
        count += len(local)
    return np.concatenate(points), np.concatenate(faces)


def _floor(model: mujoco.MjModel, geom: int, around_m: Array) -> tuple[Array, IntArray]:
    """A square of the floor around points (N, 2), in the frame of its body."""
    low, high = around_m.min(axis=0), around_m.max(axis=0)
    half = float((high - low).max()) / 2 + _MARGIN_M
    top = model.geom_size[geom, 2] if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX else 0.0
    corners = half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) + (low + high) / 2
    turn = rotations.matrix(model.geom_quat[geom])
    local = np.column_stack((corners, np.full(4, top)))
    return local @ turn.T + model.geom_pos[geom], np.array([[0, 1, 2], [0, 2, 3]])
