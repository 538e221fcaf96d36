"""glTF 2.0 in one binary file (GLB): nodes, meshes, a skin and animations, put together piece by piece.

Khronos, "glTF 2.0 Specification", sections 3 and 4.4.
"""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np

from simrecon.types import Array, IntArray

FLOAT, USHORT, UINT, UBYTE = 5126, 5123, 5125, 5121
_TYPES = {FLOAT: "<f4", USHORT: "<u2", UINT: "<u4", UBYTE: "u1"}
_SHAPES = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}
_VERTICES, _INDICES = 34962, 34963
_MAGIC, _JSON, _BIN = 0x46546C67, 0x4E4F534A, 0x004E4942


class Document:
    """A glTF document that grows; every `add_…` returns the index of what it added.

    Attributes:
        content: the JSON part.
    """

    def __init__(self, generator: str) -> None:
        self.content: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": generator},
            "scene": 0,
            "scenes": [{"nodes": []}],
        }
        self._data = bytearray()

    def add(self, kind: str, entry: dict[str, Any]) -> int:
        """Add an entry to one of the document's lists, such as `nodes`."""
        entries: list[dict[str, Any]] = self.content.setdefault(kind, [])
        entries.append(entry)
        return len(entries) - 1

    def add_node(self, entry: dict[str, Any], *, root: bool = True) -> int:
        """Add a node, at the top of the scene if it is a root."""
        index = self.add("nodes", entry)
        if root:
            self.content["scenes"][0]["nodes"].append(index)
        return index

    def add_array(
        self, values: Array | IntArray, component: int = FLOAT, *, target: int | None = None
    ) -> int:
        """Add an accessor.

        Args:
            values: (N, ...) numbers, or (N, 4, 4) matrices.
            component: type of its numbers.
            target: what a graphics card uses it for, or None.
        """
        rows = np.asarray(values).astype(_TYPES[component])
        stored = np.swapaxes(rows, 1, 2) if rows.shape[1:] == (4, 4) else rows  # columns first
        self._data += b"\0" * (-len(self._data) % 4)
        raw = np.ascontiguousarray(stored).tobytes()
        view = {"buffer": 0, "byteOffset": len(self._data), "byteLength": len(raw)}
        if target is not None:
            view["target"] = target
        self._data += raw
        accessor: dict[str, Any] = {
            "bufferView": self.add("bufferViews", view),
            "componentType": component,
            "count": len(rows),
            "type": _SHAPES[rows.shape[1:]],
        }
        if component == FLOAT and rows.ndim < 3:
            flat = rows.reshape(len(rows), -1)
            accessor |= {"min": flat.min(axis=0).tolist(), "max": flat.max(axis=0).tolist()}
        return self.add("accessors", accessor)

    def add_mesh(
        self, name: str, vertices_m: Array, normals: Array, faces: IntArray, material: int, **more: int
    ) -> int:
        """Add a mesh of one primitive.

        Args:
            name: of the mesh.
            vertices_m: (V, 3).
            normals: (V, 3) of length one.
            faces: (F, 3).
            material: its index.
            more: accessors of further attributes.
        """
        narrow = USHORT if len(vertices_m) < 65536 else UINT
        primitive = {
            "attributes": {
                "POSITION": self.add_array(vertices_m, target=_VERTICES),
                "NORMAL": self.add_array(normals, target=_VERTICES),
                **more,
            },
            "indices": self.add_array(faces.reshape(-1), narrow, target=_INDICES),
            "material": material,
        }
        return self.add("meshes", {"name": name, "primitives": [primitive]})

    def add_weights(self, joints: IntArray, weights: Array) -> dict[str, int]:
        """Add the attributes of a skin: (V, 4) joints, and how much each moves the vertex."""
        return {
            "JOINTS_0": self.add_array(joints, UBYTE, target=_VERTICES),
            "WEIGHTS_0": self.add_array(weights, target=_VERTICES),
        }

    def add_material(self, name: str, colour: Array, roughness: float = 0.8, **more: Any) -> int:
        """Add a material of one colour: sRGB (3,), 0 to 1."""
        surface = {
            "baseColorFactor": [*_linear(colour).round(5).tolist(), 1.0],
            "metallicFactor": 0.0,
            "roughnessFactor": roughness,
        }
        return self.add("materials", {"name": name, "pbrMetallicRoughness": surface, **more})

    def binary(self) -> bytes:
        """The file."""
        self._data += b"\0" * (-len(self._data) % 4)
        self.content["buffers"] = [{"byteLength": len(self._data)}]
        text = json.dumps(self.content, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        length = 12 + 8 + len(text) + 8 + len(self._data)
        head = struct.pack("<III", _MAGIC, 2, length)
        chunks = struct.pack("<II", len(text), _JSON) + text + struct.pack("<II", len(self._data), _BIN)
        return head + chunks + bytes(self._data)


class Clip:
    """An animation of a document that grows by channels.

    Args:
        document: that it belongs to.
        name: of the animation.
        times_s: (T,) of all its keys, from 0 on.
    """

    def __init__(self, document: Document, name: str, times_s: Array) -> None:
        self._document, self._input = document, document.add_array(times_s)
        self._entry: dict[str, Any] = {"name": name, "samplers": [], "channels": []}
        document.add("animations", self._entry)

    def add(self, node: int, path: str, values: Array) -> None:
        """Move a node.

        Args:
            node: its index.
            path: `translation`, `rotation` or `scale`.
            values: (T, 3) m or factors, or (T, 4) unit quaternions x y z w.
        """
        sampler = {"input": self._input, "output": self._document.add_array(values)}
        self._entry["samplers"].append({**sampler, "interpolation": "LINEAR"})
        target = {"node": node, "path": path}
        self._entry["channels"].append({"sampler": len(self._entry["samplers"]) - 1, "target": target})


def vertex_normals(vertices_m: Array, faces: IntArray) -> Array:
    """Normals (V, 3) of vertices: the mean of those of the faces around, by area."""
    a, b, c = np.moveaxis(vertices_m[faces], 1, 0)  # (F, 3) each
    across = np.cross(b - a, c - a)
    normals = np.zeros_like(vertices_m)
    for corner in range(3):
        np.add.at(normals, faces[:, corner], across)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    up = np.array([0.0, 1.0, 0.0])  # of a vertex that no face has
    return np.asarray(np.where(lengths > 0, normals / np.maximum(lengths, 1e-30), up))


def quaternions(wxyz: Array) -> Array:
    """Rotations (T, 4), w first, as glTF has them: w last, and without jumps of sign over time."""
    turned = np.concatenate((wxyz[..., 1:], wxyz[..., :1]), axis=-1)
    if turned.ndim > 1 and len(turned) > 1:
        flips = np.where((turned[1:] * turned[:-1]).sum(axis=-1, keepdims=True) < 0, -1.0, 1.0)
        turned[1:] *= np.cumprod(flips, axis=0)
    return np.asarray(turned / np.linalg.norm(turned, axis=-1, keepdims=True))


def _linear(colour: Array) -> Array:
    """Linear light of sRGB."""
    return np.asarray(np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4))
