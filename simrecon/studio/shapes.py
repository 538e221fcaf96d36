"""Triangles of what is seen: the person as skin or primitives, and items. V vertices, F faces, S segments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon import scene as scenes
from simrecon.body import clothed
from simrecon.drawing.shapes import Roundness, surface, triangles
from simrecon.geometry import rotations
from simrecon.scene.mjcf import ITEM_PREFIX
from simrecon.sim.models import compile_text
from simrecon.sim.poses import at_rest
from simrecon.types import Array, Body, IntArray, Scene, SceneItem

INFLUENCES = 4
"""Segments that move a vertex at most: what browsers draw."""
_CELL_M = 10.0
_ROUND = Roundness(sides=12, rings=3)
"""Of a person that moves: a browser without a graphics card draws each triangle anew in each frame."""
_EMPTY = '<mujoco><worldbody><body name="pelvis"><geom size="0.01"/></body></worldbody></mujoco>'


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles: vertices (V, 3) m, faces (F, 3)."""

    vertices_m: Array
    faces: IntArray


@dataclass(frozen=True, eq=False)
class Rigged:
    """Triangles that segments move.

    Attributes:
        mesh: at the pose in which it was made.
        weights: (V, S), rows sum to 1, at most `INFLUENCES` of them not zero.
        places_m, turns: (S, 3), (S, 4) of the segments at that pose.
    """

    mesh: Mesh
    weights: Array
    places_m: Array
    turns: Array


def skin(body: Body) -> Rigged:
    """The skin of a body in the relaxed stance, as everywhere; see `body.clothed`."""
    found = clothed.skin(body)
    rows, strong = found.strongest(INFLUENCES)
    weights = np.zeros_like(found.weights)
    np.put_along_axis(weights, rows, strong, axis=1)
    mesh = Mesh(found.vertices_m, found.faces)
    return Rigged(mesh, weights, found.origins_m, rotations.from_matrix(found.axes))


def primitives(body: Body) -> Rigged:
    """The primitives of a body, each rigid on its segment, at the model's own pose."""
    model = compile_text(body.mjcf)
    data = at_rest(model)
    geoms = [model.geom(part.name).id for part in body.primitives]
    quads = surface(model, geoms, _CELL_M, _ROUND)
    names = body.skeleton.names
    segment = {geom: names.index(part.segment) for geom, part in zip(geoms, body.primitives, strict=True)}
    rows = np.array([segment[int(geom)] for geom in quads.vertex_geom])
    bodies = [model.body(name).id for name in names]
    mesh = Mesh(quads.place(data.geom_xpos, data.geom_xmat), triangles(quads.faces))
    return Rigged(mesh, np.eye(len(names))[rows], data.xpos[bodies].copy(), data.xquat[bodies].copy())


def item_mesh(item: SceneItem, folder: str) -> Mesh:
    """An item in its own frame: origin at the centre of its footprint, at its lowest height, z up.

    Raises:
        InputError: its mesh can't be used.
    """
    at_origin = SceneItem(item.name, item.kind, (0.0, 0.0, 0.0), item.parameters)
    model = compile_text(scenes.build(_EMPTY, Scene(items=(at_origin,), folder=folder), 0.01))
    names = [model.geom(row).name for row in range(model.ngeom)]
    seen = [row for row, name in enumerate(names) if name.startswith(ITEM_PREFIX) and model.geom_rgba[row, 3]]
    quads, data = surface(model, seen, _CELL_M), at_rest(model)
    return Mesh(quads.place(data.geom_xpos, data.geom_xmat), triangles(quads.faces))
