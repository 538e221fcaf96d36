"""What of a model is drawn as faces: the person, in their skin or as primitives, and the items."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
import scipy

from simrecon.body.clothed import Skin
from simrecon.body.skeleton import template
from simrecon.drawing import shapes
from simrecon.drawing.geoms import CENTRE, LEFT, RIGHT, Geoms
from simrecon.drawing.shapes import Surface
from simrecon.geometry import vectors
from simrecon.sim.poses import at_rest
from simrecon.types import Array, IntArray


@dataclass(frozen=True, eq=False)
class Worn:
    """A skin on the bodies of a model. V vertices, each moved by K of the S segments.

    Attributes:
        bodies: (S,) ids of the segments' bodies.
        local_m: (V, K, 3) the vertices in the segments that move them; rows: (V, K) which; weights: (V, K).
    """

    bodies: IntArray
    local_m: Array
    rows: IntArray
    weights: Array

    @classmethod
    def of(cls, model: mujoco.MjModel, skin: Skin) -> Worn:
        """The skin of the person in a model."""
        bodies = np.array([model.body(name).id for name in template().names], np.int64)
        most = int((skin.weights > 0).sum(axis=1).max())
        rows = np.argsort(-skin.weights, axis=1, kind="stable")[:, :most]  # (V, K)
        off = skin.vertices_m[:, None] - skin.origins_m[rows]  # (V, K, 3)
        local = np.einsum("vkji,vkj->vki", skin.axes[rows], off)
        return cls(bodies, local, rows, np.take_along_axis(skin.weights, rows, axis=1))

    def place(self, data: mujoco.MjData) -> Array:
        """Places of the vertices (V, 3) in the world: linear blend skinning."""
        turn = data.xmat[self.bodies].reshape(-1, 3, 3)[self.rows]  # (V, K, 3, 3)
        moved = (turn @ self.local_m[..., None])[..., 0] + data.xpos[self.bodies][self.rows]
        return np.asarray((self.weights[..., None] * moved).sum(axis=1))


@dataclass(frozen=True, eq=False)
class Figure:
    """Faces that follow a model. V vertices, F faces.

    Attributes:
        faces: (F, 4) vertex indices, counter-clockwise seen from outside, triangles with the last one twice.
        face_geom, vertex_geom: (F,), (V,) ids of the geoms that they belong to.
        colours: (F, 3) blue, green, red.
        round: how many of the first faces are of a skin, which is shaded smoothly.
        worn: the skin, whose vertices come first, or None; surface: what follows the geoms.
    """

    faces: IntArray
    face_geom: IntArray
    vertex_geom: IntArray
    colours: Array
    round: int
    worn: Worn | None
    surface: Surface

    def place(self, data: mujoco.MjData) -> Array:
        """Places of the vertices (V, 3) in the world."""
        rigid = self.surface.place(data.geom_xpos, data.geom_xmat)
        return rigid if self.worn is None else np.concatenate((self.worn.place(data), rigid))

    def normals(self, vertices_m: Array) -> Array:
        """Normals (F, 3) of length one; those of a skin are the mean of the faces around."""
        corners = vertices_m[self.faces]  # (F, 4, 3)
        flat = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
        if self.round:
            skinned = self.faces[: self.round, :3]
            at, across = skinned.ravel(), np.repeat(flat[: self.round], 3, axis=0)
            summed = [np.bincount(at, component, len(vertices_m)) for component in across.T]
            flat[: self.round] = np.stack(summed, axis=-1)[skinned].sum(axis=1)
        return vectors.unit(flat)


def both(
    model: mujoco.MjModel, geoms: Geoms, skin: Skin | None, cells_m: tuple[float, float]
) -> tuple[Figure, Figure]:
    """The person alone, and with the items.

    Args:
        model: the compiled model.
        geoms: of the model.
        skin: of the person; None: their primitives.
        cells_m: largest edges of the quads of the person alone, and with the items.
    """
    person, items, colours = geoms.person, geoms.items, geoms.colours
    if skin is None:
        alone = of_geoms(model, person, cells_m[0], colours)
        return alone, of_geoms(model, person + items, cells_m[1], colours)
    nothing, rest = (of_geoms(model, others, cells_m[1], colours) for others in ([], items))
    return clothed(model, skin, person, nothing), clothed(model, skin, person, rest)


def of_geoms(model: mujoco.MjModel, geoms: Sequence[int], cell_m: float, colours: Array) -> Figure:
    """Geoms as quads.

    Args:
        model: the compiled model.
        geoms: ids.
        cell_m: largest edge of a box's quads.
        colours: (G, 3) of all geoms of the model.
    """
    surface = shapes.surface(model, geoms, cell_m)
    tones = colours[surface.face_geom]
    return Figure(surface.faces, surface.face_geom, surface.vertex_geom, tones, 0, None, surface)


def clothed(model: mujoco.MjModel, skin: Skin, person: Sequence[int], rest: Figure) -> Figure:
    """A skin instead of the person's primitives, before what else is drawn.

    Args:
        model: the compiled model.
        skin: of the person.
        person: ids of the primitives; each face belongs to the nearest one, which says what is pushed.
        rest: what else is drawn.
    """
    worn = Worn.of(model, skin)
    data = at_rest(model)
    vertices = worn.place(data)
    own = _nearest(shapes.surface(model, person, 0.05), data, vertices)
    quads = np.concatenate((skin.faces, skin.faces[:, 2:]), axis=1)
    return Figure(
        np.concatenate((quads, rest.faces + len(vertices))),
        np.concatenate((own[skin.faces[:, 0]], rest.face_geom)),
        np.concatenate((own, rest.vertex_geom)),
        np.concatenate((_tones(skin)[skin.faces].mean(axis=1), rest.colours)),
        len(quads),
        worn,
        rest.surface,
    )


def _nearest(surface: Surface, data: mujoco.MjData, points_m: Array) -> IntArray:
    """Ids (V,) of the geoms whose surface is nearest to points (V, 3)."""
    near = scipy.spatial.KDTree(surface.place(data.geom_xpos, data.geom_xmat)).query(points_m)[1]
    return np.asarray(surface.vertex_geom[near])


def _tones(skin: Skin) -> Array:
    """Colours (V, 3) of the vertices by the side of the segments that move them, blue green red."""
    names = template().names
    sides = np.array([[name.startswith(f"{side}_") for name in names] for side in ("left", "right")], float)
    share = skin.weights @ sides.T  # (V, 2)
    own = np.array([LEFT, RIGHT], float)
    return np.asarray(share @ own + (1 - share.sum(axis=1, keepdims=True)) * np.array(CENTRE, float))
