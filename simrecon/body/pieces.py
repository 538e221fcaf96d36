"""The skin cut into one closed piece per segment (M_b of Gärtner 2022, eq. 9)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from simrecon.types import Array, IntArray

_NEAR_VERTICES = 2


@dataclass(frozen=True, eq=False)
class Piece:
    """Which vertices and faces of a skin belong to a segment; no places, so it serves every shape.

    The piece is open where it meets the next segments. Each opening is closed by a fan around the mean of
    its rim, so that a primitive's end within the body is measured against where the segment ends.

    Attributes:
        segment: index of the segment.
        own: (n,) skin vertices that belong to it.
        rows: (m,) skin vertices that its faces use.
        rims: one array of indices into `rows` per opening; the fans' hubs follow `rows` as further vertices.
        faces: (f, 3) into `rows` and hubs.
        fans: (f) whether a face is of a fan.
        around: (m, d) faces at each vertex but the hubs, the last one repeated.
    """

    segment: int
    own: IntArray
    rows: IntArray
    rims: tuple[IntArray, ...]
    faces: IntArray
    fans: np.ndarray
    around: IntArray

    def vertices(self, skin: Array) -> Array:
        """Vertices (..., m + hubs, 3) of a skin (..., V, 3)."""
        places = skin[..., self.rows, :]
        hubs = [places[..., rim, :].mean(axis=-2, keepdims=True) for rim in self.rims]
        return np.concatenate((places, *hubs), axis=-2)


def cut(faces: IntArray, labels: IntArray) -> dict[int, Piece]:
    """Cut a skin by the segment of each vertex.

    Args:
        faces: (F, 3).
        labels: (V,) segment of each vertex.

    Returns:
        By segment. A face belongs to the segment that two of its corners have, or else to its first corner's.
    """
    corners = labels[faces]  # (F, 3)
    owner = np.where(corners[:, 1] == corners[:, 2], corners[:, 1], corners[:, 0])
    return {
        int(segment): _piece(int(segment), faces[owner == segment], labels) for segment in np.unique(owner)
    }


def _piece(segment: int, faces: IntArray, labels: IntArray) -> Piece:
    rows, local = np.unique(faces, return_inverse=True)
    local = local.reshape(-1, 3)
    edges = local[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    border = edges[first[count == 1]]  # (E, 2) directed like their face
    link = scipy.sparse.coo_array(
        (np.ones(len(border)), (border[:, 0], border[:, 1])), shape=(len(rows), len(rows))
    )
    group = scipy.sparse.csgraph.connected_components(link, directed=False)[1]
    rims: list[IntArray] = []
    fans = []
    for number in np.unique(group[border[:, 0]]):
        part = border[group[border[:, 0]] == number]
        hub = len(rows) + len(rims)
        rims.append(np.unique(part))
        fans.append(np.column_stack((part[:, ::-1], np.full(len(part), hub))))
    closed = np.concatenate((local, *fans))
    is_fan = np.arange(len(closed)) >= len(local)
    around = _around(closed, len(rows))
    return Piece(segment, np.flatnonzero(labels == segment), rows, tuple(rims), closed, is_fan, around)


def _around(faces: IntArray, count: int) -> IntArray:
    """Faces at each vertex, padded with its last one."""
    vertex, face = faces.ravel(), np.repeat(np.arange(len(faces)), 3)
    vertex, face = vertex[vertex < count], face[vertex < count]
    order = np.argsort(vertex, kind="stable")
    start = np.searchsorted(vertex[order], np.arange(count + 1))
    number = np.diff(start)
    column = np.minimum(np.arange(number.max())[None], number[:, None] - 1)  # (count, d)
    return np.asarray(face[order][start[:-1, None] + column], dtype=np.int64)


def vertex_areas(vertices_m: Array, faces: IntArray) -> Array:
    """A third of the area of the faces at each vertex, (V,)."""
    from trimesh import triangles  # not with the module: few runs need it

    area = triangles.area(vertices_m[faces]) / 3.0  # type: ignore[no-untyped-call]  # (F,)
    return np.bincount(faces.ravel(), np.repeat(area, 3), minlength=len(vertices_m)).astype(np.float64)


def closest(piece: Piece, vertices_m: Array, points_m: Array) -> Array:
    """Nearest point (P, 3) of a piece to each point (P, 3).

    Only faces at the two nearest vertices are looked at, of a fan those at the nearest of its rim.
    """
    from trimesh import triangles  # not with the module: few runs need it

    _, near = scipy.spatial.cKDTree(vertices_m[: len(piece.rows)]).query(points_m, k=_NEAR_VERTICES)
    candidates = piece.around[near].reshape(len(points_m), -1)  # (P, C)
    corners = vertices_m[piece.faces[candidates]].reshape(-1, 3, 3)
    repeated = np.repeat(points_m, candidates.shape[1], axis=0)
    nearest = triangles.closest_point(corners, repeated)  # type: ignore[no-untyped-call]
    nearest = nearest.reshape(*candidates.shape, 3)
    best = np.argmin(np.linalg.norm(nearest - points_m[:, None], axis=-1), axis=1)
    return np.asarray(nearest[np.arange(len(points_m)), best])
