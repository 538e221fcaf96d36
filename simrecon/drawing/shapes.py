"""Geoms of a MuJoCo model as quads, ready to be drawn. V vertices, F faces, G geoms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np

from simrecon.types import Array, IntArray

_GEOM = mujoco.mjtGeom


class Roundness(NamedTuple):
    """Of how many flat pieces what is round is made: around its axis, and from the pole to the equator."""

    sides: int = 20
    rings: int = 5


FINE = Roundness()


@dataclass(frozen=True, eq=False)
class Surface:
    """Quads of one or more geoms.

    Attributes:
        vertices_m: (V, 3) in the frame of their geom.
        vertex_geom: (V,) id of the geom.
        faces: (F, 4) vertex indices, counter-clockwise seen from outside.
        face_geom: (F,) id of the geom.
    """

    vertices_m: Array
    vertex_geom: IntArray
    faces: IntArray
    face_geom: IntArray

    def place(self, geom_xpos: Array, geom_xmat: Array) -> Array:
        """World positions of the vertices, (V, 3), from (G, 3) and (G, 9) of `MjData`."""
        rotation = geom_xmat.reshape(-1, 3, 3)[self.vertex_geom]  # (V, 3, 3)
        rotated: Array = np.einsum("vij,vj->vi", rotation, self.vertices_m)
        return rotated + geom_xpos[self.vertex_geom]


def triangles(faces: IntArray) -> IntArray:
    """Two triangles for each of (F, 4) faces, without those of no area: a corner may stand twice."""
    both = np.concatenate((faces[:, :3], faces[:, [0, 2, 3]]))
    return np.asarray(both[(np.diff(np.sort(both, axis=1), axis=1) > 0).all(axis=1)])


def surface(
    model: mujoco.MjModel, geoms: Sequence[int], cell_m: float, roundness: Roundness = FINE
) -> Surface:
    """Quads of some geoms: all but planes. Triangles of a mesh are quads with their last corner twice.

    Args:
        model: the compiled model.
        geoms: ids of the geoms.
        cell_m: largest edge of a box's quads; small ones sort better by depth.
        roundness: of what is round.
    """
    vertices: list[Array] = [np.zeros((0, 3))]
    faces: list[IntArray] = [np.zeros((0, 4), np.int64)]
    vertex_geom, face_geom, count = [], [], 0
    for geom in geoms:
        kind, data = int(model.geom_type[geom]), int(model.geom_dataid[geom])
        if kind == _GEOM.mjGEOM_MESH:
            points, quads = _mesh(model, data)
        elif kind == _GEOM.mjGEOM_HFIELD:
            points, quads = _field(model, data)
        else:
            points, quads = _local(kind, np.array(model.geom_size[geom]), cell_m, roundness)
        vertices.append(points)
        faces.append(quads + count)
        vertex_geom += [geom] * len(points)
        face_geom += [geom] * len(quads)
        count += len(points)
    return Surface(
        np.concatenate(vertices),
        np.array(vertex_geom, np.int64),
        np.concatenate(faces),
        np.array(face_geom, np.int64),
    )


def box_edges(half_m: Array) -> tuple[Array, IntArray]:
    """The twelve edges of a box.

    Args:
        half_m: (3,) half sizes.

    Returns:
        (12, 2, 3) end points, and (12, 2) the two faces that meet there: 0 to 5 for +x, -x, +y, -y, +z, -z.
    """
    ends, meeting = [], []
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        for sign_b in (1, -1):
            for sign_c in (1, -1):
                edge = np.zeros((2, 3))
                edge[:, axis] = -1, 1
                edge[:, b], edge[:, c] = sign_b, sign_c
                ends.append(edge * half_m)
                meeting.append((2 * b + (sign_b < 0), 2 * c + (sign_c < 0)))
    return np.array(ends), np.array(meeting, np.int64)


def _mesh(model: mujoco.MjModel, mesh: int) -> tuple[Array, IntArray]:
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    start, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    corners = np.asarray(model.mesh_face[start : start + faces], np.int64)  # (F, 3)
    points = np.asarray(model.mesh_vert[first : first + count], np.float64)
    return points, np.concatenate((corners, corners[:, 2:]), axis=1)


def _field(model: mujoco.MjModel, field: int) -> tuple[Array, IntArray]:
    """The upper side of a height field."""
    rows, columns, start = (int(a[field]) for a in (model.hfield_nrow, model.hfield_ncol, model.hfield_adr))
    x, y, top = model.hfield_size[field, :3]
    heights = model.hfield_data[start : start + rows * columns].reshape(rows, columns) * top
    across, along = np.meshgrid(np.linspace(-x, x, columns), np.linspace(-y, y, rows))
    points = np.stack((across, along, heights), axis=-1).reshape(-1, 3).astype(np.float64)
    index = np.arange(rows * columns).reshape(rows, columns)
    corners = (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1])
    return points, np.stack(corners, axis=-1).reshape(-1, 4).astype(np.int64)


def _local(kind: int, size: Array, cell_m: float, roundness: Roundness) -> tuple[Array, IntArray]:
    sides, rings = roundness
    if kind == _GEOM.mjGEOM_BOX:
        return _box(size, cell_m)
    if kind == _GEOM.mjGEOM_SPHERE:
        return _revolve(size[0] * _arc(-1.0, 1.0, 2 * rings), sides)
    if kind == _GEOM.mjGEOM_ELLIPSOID:
        points, quads = _revolve(_arc(-1.0, 1.0, 2 * rings), sides)
        return points * size, quads
    if kind == _GEOM.mjGEOM_CAPSULE:
        radius, half = size[0], np.array([0.0, size[1]])
        bands = max(1, int(np.ceil(2 * size[1] / cell_m)))
        middle = np.stack((np.full(bands + 1, radius), np.linspace(-size[1], size[1], bands + 1)), -1)[1:-1]
        below, above = radius * _arc(-1.0, 0.0, rings) - half, radius * _arc(0.0, 1.0, rings) + half
        return _revolve(np.concatenate((below, middle, above)), sides)
    if kind == _GEOM.mjGEOM_CYLINDER:
        radius, half_length = size[0], size[1]
        return _revolve(np.array([[0, -1], [1, -1], [1, 0], [1, 1], [0, 1]]) * [radius, half_length], sides)
    return np.zeros((0, 3)), np.zeros((0, 4), np.int64)


def _arc(start: float, stop: float, steps: int) -> Array:
    """Points (r, z) of a unit half circle, latitudes in quarter turns."""
    latitude = np.linspace(start, stop, steps + 1) * np.pi / 2
    return np.stack((np.cos(latitude), np.sin(latitude)), axis=-1)  # (steps + 1, 2)


def _revolve(profile: Array, sides: int) -> tuple[Array, IntArray]:
    """Turn (P, 2) points (r, z), z increasing, around the z axis."""
    angle = np.arange(sides) * 2 * np.pi / sides
    around = np.stack((np.cos(angle), np.sin(angle)), axis=-1)  # (S, 2)
    rings = np.empty((len(profile), sides, 3))
    rings[..., :2] = profile[:, None, :1] * around
    rings[..., 2] = profile[:, 1:]
    low, here = np.arange(len(profile) - 1)[:, None] * sides, np.arange(sides)
    after = (here + 1) % sides
    quads = np.stack((low + here, low + after, low + sides + after, low + sides + here), axis=-1)
    return rings.reshape(-1, 3), quads.reshape(-1, 4).astype(np.int64)


def _box(half_m: Array, cell_m: float) -> tuple[Array, IntArray]:
    cells = np.maximum(1, np.ceil(2 * half_m / cell_m)).astype(int)  # (3,)
    vertices, faces, count = [], [], 0
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        for sign in (1.0, -1.0):
            u, v = np.linspace(-1, 1, cells[b] + 1), np.linspace(-1, 1, cells[c] + 1)
            grid = np.empty((len(u), len(v), 3))
            grid[..., axis], grid[..., b], grid[..., c] = sign, u[:, None], v
            index = np.arange(len(u) * len(v)).reshape(len(u), len(v)) + count
            corners = (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:])
            quads = np.stack(corners if sign > 0 else corners[::-1], axis=-1).reshape(-1, 4)
            vertices.append(grid.reshape(-1, 3) * half_m)
            faces.append(quads.astype(np.int64))
            count += grid.shape[0] * grid.shape[1]
    return np.concatenate(vertices), np.concatenate(faces)
