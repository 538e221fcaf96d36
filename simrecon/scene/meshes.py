"""Meshes from files, and what stands for them."""

from __future__ import annotations

import functools
import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from simrecon.errors import InputError
from simrecon.io import foreign
from simrecon.io.reading import read_bytes
from simrecon.scene.kinds import LARGEST_M
from simrecon.scene.mesh_shapes import (
    MAX_TRIANGLES,
    Field,
    convex_parts,
    height_field,
    hull_points,
    simplified,
)
from simrecon.system import extras
from simrecon.types import Array, IntArray, SceneItem

SUFFIXES = (".stl", ".obj", ".ply", ".off", ".glb", ".gltf")


def path(item: SceneItem, folder: str, where: str) -> Path:
    """The file of a mesh.

    Raises:
        InputError: it is not inside the folder, missing, or of a format that is not read.
    """
    name = str(item.parameters["file"])
    root = Path(folder).resolve()
    file = (root / name).resolve()
    if not file.is_relative_to(root):
        raise InputError(
            f"{where} file {name!r} is outside the scene's folder; valid: a file inside {folder}"
        )
    if not file.is_file():
        raise InputError(f"{where} file {name!r}: no such file in {folder}")
    if file.suffix.lower() not in SUFFIXES:
        raise InputError(f"{where} file {name!r} is of an unknown format; valid: {', '.join(SUFFIXES)}")
    return file


def check(item: SceneItem, folder: str, where: str) -> None:
    """Check the mesh of an item, except by the work that takes long.

    Raises:
        InputError: it can't be read, has no volume, or lacks what its method needs.
    """
    file, method = path(item, folder, where), item.parameters["method"]
    import trimesh  # not with the module: few scenes need it

    vertices, faces = _raw(str(file), file.stat().st_mtime_ns, where)
    values: dict[str, Any] = dict(item.parameters)
    extent = float(values["scale"] * np.ptp(vertices, axis=0).max())
    if not extent <= LARGEST_M:
        raise InputError(
            f"{where} file {values['file']!r} is {extent:.3g} m large; valid: up to {LARGEST_M:g} m, with a "
            f"scale that makes metres of its unit"
        )
    if method == "parts":
        if importlib.util.find_spec("coacd") is None:
            raise InputError(
                f"{where} method 'parts' needs coacd: {extras.how('mesh')}; without it: 'hull' or 'height'"
            )
        if not trimesh.Trimesh(vertices, faces, process=True).is_watertight:
            raise InputError(
                f"{where} file {item.parameters['file']!r} is not watertight, so it has no inside to cut "
                f"into parts; valid: a closed mesh, or the methods 'hull' and 'height'"
            )
    try:
        scipy.spatial.ConvexHull(vertices)
    except (scipy.spatial.QhullError, ValueError) as error:
        raise InputError(f"{where} file {item.parameters['file']!r} is flat: it has no volume") from error


def note(item: SceneItem, folder: str) -> str:
    """One line on what stands for the mesh, for people."""
    file = path(item, folder, item.name)
    count = len(_raw(str(file), file.stat().st_mtime_ns, item.name)[1])
    shape = load(item, folder)
    if isinstance(shape, Field):
        rows, columns = shape.heights_m.shape
        return f"{count} triangles, as a height field of {columns} x {rows} heights"
    kept = sum(len(points) for points in shape)
    simpler = ", simplified first" if count > MAX_TRIANGLES and item.parameters["method"] == "parts" else ""
    hulls = "its convex hull" if len(shape) == 1 else f"{len(shape)} convex parts"
    return f"{count} triangles{simpler}, as {hulls} with {kept} vertices"


def load(item: SceneItem, folder: str) -> tuple[Array, ...] | Field:
    """What stands for a mesh: the points (V, 3) of each convex part, in the item's frame, or a field.

    Raises:
        InputError: the file can't be used.
    """
    where = f"item ({item.name})"
    file = path(item, folder, where)
    values: dict[str, Any] = dict(item.parameters)
    key = (values["method"], values["scale"], values["up"], values["parts"], values["cells"])
    return _shape(str(file), file.stat().st_mtime_ns, where, *key)


@functools.lru_cache(maxsize=16)
def _shape(
    file: str, changed: int, where: str, method: str, scale: float, up: str, parts: int, cells: int
) -> tuple[Array, ...] | Field:
    vertices, faces = _raw(file, changed, where)
    vertices = scale * vertices
    if up == "y":
        vertices = vertices[:, [0, 2, 1]] * [1.0, -1.0, 1.0]
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    vertices = vertices - [*(low[:2] + high[:2]) / 2, low[2]]
    if method == "hull":
        return (hull_points(vertices),)
    vertices, faces = simplified(vertices, faces)
    if method == "height":
        return height_field(vertices, faces, cells)
    return convex_parts(vertices, faces, parts)


@functools.lru_cache(maxsize=16)
def _raw(file: str, changed: int, where: str) -> tuple[Array, IntArray]:
    """Vertices (V, 3) and triangles (F, 3) of a file; `changed` is the file's time, for the cache."""
    del changed
    path = Path(file)
    try:
        found = foreign.parse("mesh", read_bytes(path), path.suffix[1:].lower(), str(path.parent))
    except (OSError, foreign.DamageError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{where} {file}: cannot be read as a mesh: {reason}") from error
    vertices, faces = found["vertices"], found["faces"]
    if not faces.size or not np.isfinite(vertices).all():
        raise InputError(f"{where} {file}: it has no finite triangles")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError(f"{where} {file}: a triangle names a vertex that is not there")
    used = np.unique(faces)
    place = np.zeros(len(vertices), np.int64)
    place[used] = np.arange(len(used))
    return vertices[used], place[faces]
