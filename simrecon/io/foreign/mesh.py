"""trimesh, in a process of its own: meshes of scenes as STL, OBJ, PLY, OFF, glTF or GLB."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from trimesh.exchange.load import load_mesh
from trimesh.resolvers import Resolver

from simrecon.io.reading import read_bytes

BUFFERS = ".bin"
"""Ending of the files beside a glTF that hold its numbers."""
PICTURES = (".png", ".jpg", ".jpeg", ".webp", ".ktx2")
_BARE = ("obj", "ply")
"""Formats whose readers can be told to leave materials alone."""


class Beside(Resolver):
    """Files that a mesh names: its buffers, as regular files in its own folder; pictures are empty."""

    def __init__(self, folder: str) -> None:
        self._folder = Path(folder).resolve()

    def get(self, key: str) -> bytes:
        """The content of a file.

        Raises:
            OSError: it is none that a mesh needs, or can't be read.
        """
        path = (self._folder / str(key)).resolve()
        if path.suffix.lower() in PICTURES:
            return b""
        if path.suffix.lower() != BUFFERS or not path.is_relative_to(self._folder):
            raise OSError(f"it names {str(key)[:80]!r}, which is no {BUFFERS} file in its folder")
        return read_bytes(path)

    def write(self, *_: Any) -> None:
        """Nothing is written."""
        raise OSError("nothing is written")

    def namespaced(self, *_: Any) -> Beside:
        """The same: there are no folders in it."""
        return self

    def keys(self) -> list[str]:
        """None is known beforehand."""
        return []


def parse(path: str, kind: str, folder: str) -> dict[str, NDArray[Any]]:
    """Vertices (V, 3) and triangles (F, 3) of a mesh, all parts of a scene as one.

    Args:
        path: of the file.
        kind: its ending, without the dot.
        folder: where it was, and where its buffers are.

    Raises:
        ValueError: it is not of this format.
    """
    more = {"skip_materials": True} if kind in _BARE else {}
    try:
        with open(path, "rb") as file:
            mesh = load_mesh(file, file_type=kind, resolver=Beside(folder), **more)
    except ModuleNotFoundError as error:  # trimesh looks for help with text of an unknown encoding
        raise ValueError(f"it is no {kind.upper()} file") from error
    return {"vertices": np.asarray(mesh.vertices, float), "faces": np.asarray(mesh.faces, np.int64)}
