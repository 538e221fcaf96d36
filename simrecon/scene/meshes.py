"""Meshes from files: a convex hull, convex parts, or a height field stand for them."""

from __future__ import annotations

import functools
import importlib
import importlib.util
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from scipy.spatial import ConvexHull, QhullError

from simrecon.errors import InputError
from simrecon.types import Array, IntArray, SceneItem

MAX_TRIANGLES = 20_000
"""Above it a mesh is simplified before it is cut into parts or sampled."""
HULL_VERTICES = 64
"""Of a convex part; the hull of more vertices is taken of those farthest in so many directions."""
SUFFIXES = (".stl", ".obj", ".ply", ".off", ".glb", ".gltf")
_SEED = 0


@dataclass(frozen=True, eq=False)
class Field:
    """Heights over a rectangle.

    Attributes:
        centre_m, half_m: (3,) of the bounds.
        heights_m: (R, C) over the lowest height, rows along y, columns along x.
    """

    centre_m: Array
    half_m: Array
    heights_m: Array


def path(item: SceneItem, folder: str, where: str) -> Path:
    """The file of a mesh.

    Raises:
        InputError: it is not inside the folder, missing, or of a format that is not read.
    """
    name = str(item.parameters["file"])
    root = Path(folder).resolve()
    found = (root / name).resolve()
    if not found.is_relative_to(root):
        raise InputError(
            f"{where} file {name!r} is outside the scene's folder; valid: a file inside {folder}"
        )
    if not found.is_file():
        raise InputError(f"{where} file {name!r}: found no such file in {folder}")
    if found.suffix.lower() not in SUFFIXES:
        raise InputError(f"{where} file {name!r} is of an unknown format; valid: {', '.join(SUFFIXES)}")
    return found


def check(item: SceneItem, folder: str, where: str) -> None:
    """Check the mesh of an item, all but the long work.

    Raises:
        InputError: it can't be read, has no volume, or what its method needs is missing.
    """
    file, method = path(item, folder, where), item.parameters["method"]
    vertices, faces = _raw(str(file), file.stat().st_mtime_ns, where)
    if method == "parts":
        if importlib.util.find_spec("coacd") is None:
            raise InputError(
                f"{where} method 'parts' needs the extra `mesh`: pip install 'simrecon[mesh]'; "
                f"without it: 'hull' or 'height'"
            )
        if not trimesh.Trimesh(vertices, faces, process=True).is_watertight:
            raise InputError(
                f"{where} file {item.parameters['file']!r} is not watertight, so it has no inside to cut "
                f"into parts; valid: a closed mesh, or the methods 'hull' and 'height'"
            )
    try:
        ConvexHull(vertices)
    except (QhullError, ValueError) as error:
        raise InputError(f"{where} file {item.parameters['file']!r} is flat: it has no volume") from error


def note(item: SceneItem, folder: str) -> str:
    """One line on what stands for the mesh, for people."""
    file = path(item, folder, item.name)
    count = len(_raw(str(file), file.stat().st_mtime_ns, item.name)[1])
    found = load(item, folder)
    if isinstance(found, Field):
        rows, columns = found.heights_m.shape
        return f"{count} triangles, as a height field of {columns} x {rows} heights"
    kept = sum(len(points) for points in found)
    simpler = ", simplified first" if count > MAX_TRIANGLES and item.parameters["method"] == "parts" else ""
    hulls = "its convex hull" if len(found) == 1 else f"{len(found)} convex parts"
    return f"{count} triangles{simpler}, as {hulls} with {kept} vertices"


def load(item: SceneItem, folder: str) -> tuple[Array, ...] | Field:
    """What stands for a mesh, in the item's frame: points whose convex hulls are the parts, or a field.

    Raises:
        InputError: the file can't be used.
    """
    where = f"item ({item.name})"
    file = path(item, folder, where)
    values: dict[str, Any] = dict(item.parameters)
    key = (values["method"], values["scale"], values["up"], values["parts"], values["cells"])
    return _made(str(file), file.stat().st_mtime_ns, where, *key)


@functools.lru_cache(maxsize=16)
def _made(
    file: str, changed: int, where: str, method: str, scale: float, up: str, parts: int, cells: int
) -> tuple[Array, ...] | Field:
    vertices, faces = _raw(file, changed, where)
    vertices = scale * vertices
    if up == "y":
        vertices = vertices[:, [0, 2, 1]] * [1.0, -1.0, 1.0]
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    vertices = vertices - [*(low[:2] + high[:2]) / 2, low[2]]
    if method == "hull":
        return (few(vertices),)
    vertices, faces = simplified(vertices, faces)
    if method == "height":
        return _field(vertices, faces, cells)
    return _parts(vertices, faces, parts)


@functools.lru_cache(maxsize=16)
def _raw(file: str, changed: int, where: str) -> tuple[Array, IntArray]:
    """Vertices (V, 3) and triangles (F, 3) of a file; `changed` is the file's time, for the cache."""
    del changed
    try:
        found = trimesh.load_mesh(file)
    except Exception as error:
        raise InputError(f"{where} {file}: can't be read as a mesh: {error}") from error
    vertices, faces = np.asarray(found.vertices, float), np.asarray(found.faces, np.int64)
    if not len(faces) or not np.isfinite(vertices).all():
        raise InputError(f"{where} {file}: found no finite triangles")
    used = np.unique(faces)
    place = np.zeros(len(vertices), np.int64)
    place[used] = np.arange(len(used))
    return vertices[used], place[faces]


def simplified(vertices: Array, faces: IntArray) -> tuple[Array, IntArray]:
    """A mesh of at most `MAX_TRIANGLES`: vertices are merged in cubes that grow until it is."""
    cell = float(np.ptp(vertices, axis=0).max()) / 400
    merged, kept = vertices, faces
    while len(kept) > MAX_TRIANGLES:
        keys = np.round(vertices / cell).astype(np.int64)
        cluster = np.unique(keys, axis=0, return_inverse=True)[1]
        count = np.bincount(cluster.ravel())
        merged = np.stack([np.bincount(cluster.ravel(), column) / count for column in vertices.T], axis=1)
        kept = cluster.ravel()[faces]
        flat = (kept[:, 0] == kept[:, 1]) | (kept[:, 1] == kept[:, 2]) | (kept[:, 2] == kept[:, 0])
        kept = np.unique(kept[~flat], axis=0)
        cell *= 1.3
    return merged, kept


def few(points: Array) -> Array:
    """At most `HULL_VERTICES` points (V, 3) whose hull is nearly that of all: the farthest ones."""
    hull = points[ConvexHull(points).vertices]
    if len(hull) <= HULL_VERTICES:
        return np.asarray(hull)
    # a Fibonacci lattice on the sphere
    k = np.arange(HULL_VERTICES) + 0.5
    z, turn = 1 - 2 * k / HULL_VERTICES, np.pi * (1 + np.sqrt(5)) * k
    directions = np.stack((np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z), axis=1)
    middle, size = hull.mean(axis=0), np.maximum(np.ptp(hull, axis=0), 1e-9)
    return np.asarray(hull[np.unique(np.argmax(((hull - middle) / size) @ directions.T, axis=0))])


def _parts(vertices: Array, faces: IntArray, most: int) -> tuple[Array, ...]:
    """Approximate convex decomposition (Wei et al., CoACD, SIGGRAPH 2022)."""
    coacd = importlib.import_module("coacd")  # an extra
    coacd.set_log_level("error")
    found = coacd.run_coacd(
        coacd.Mesh(vertices, faces), max_convex_hull=most, seed=_SEED, max_ch_vertex=HULL_VERTICES
    )
    return tuple(few(np.asarray(points, float)) for points, _ in found)


def _field(vertices: Array, faces: IntArray, cells: int) -> Field:
    """Highest surface over a grid of points, found by rasterising every triangle."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    size = high - low
    edge = max(size[0], size[1]) / cells
    columns, rows = (max(2, int(np.ceil(length / edge)) + 1) for length in size[:2])
    x, y = np.linspace(low[0], high[0], columns), np.linspace(low[1], high[1], rows)
    heights = np.zeros((rows, columns))
    for corners in vertices[faces]:  # (3, 3)
        inside = [
            slice(*np.searchsorted(axis, [corners[:, i].min() - 1e-9, corners[:, i].max() + 1e-9]))
            for i, axis in enumerate((x, y))
        ]
        gx, gy = np.meshgrid(x[inside[0]], y[inside[1]])
        side = corners[1:, :2] - corners[0, :2]
        area = side[0, 0] * side[1, 1] - side[0, 1] * side[1, 0]
        if not gx.size or abs(area) < 1e-15:
            continue
        dx, dy = gx - corners[0, 0], gy - corners[0, 1]
        u, v = (dx * side[1, 1] - dy * side[1, 0]) / area, (dy * side[0, 0] - dx * side[0, 1]) / area
        z = corners[0, 2] + u * (corners[1, 2] - corners[0, 2]) + v * (corners[2, 2] - corners[0, 2])
        hit = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9)
        patch = heights[inside[1], inside[0]]
        np.maximum(patch, np.where(hit, z, 0.0), out=patch)
    return Field((low + high) / 2, size / 2, heights)
