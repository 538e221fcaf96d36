"""Floor and items of a result as nodes of a glTF document, moving where they move."""

from __future__ import annotations

import numpy as np

from simrecon.drawing import pieces
from simrecon.exports import gltf
from simrecon.exports.axes import TO_Y_UP
from simrecon.exports.gltf import Clip, Document
from simrecon.geometry import rotations
from simrecon.results import Result
from simrecon.sim.poses import posed
from simrecon.types import Array

_STILL_M, _STILL = 1e-6, 1e-7


def add(document: Document, result: Result, qpos: Array, clip: Clip) -> None:
    """Add floor and items, those that move to the clip.

    Args:
        document: to add to.
        result: whose scene.
        qpos: (T, nq) configurations at the times of the clip.
        clip: of the document.
    """
    found = list(pieces.of_scene(result.model, result.scene, qpos[:, :2]))
    places, turns = _poses(result, qpos, [piece.body for piece in found])
    materials: dict[tuple[str, bytes], int] = {}
    for column, piece in enumerate(found):
        key = (piece.name, piece.rgb.tobytes())
        if key not in materials:
            materials[key] = document.add_material(piece.name, piece.rgb)
        normals = gltf.vertex_normals(piece.points_m, piece.faces)
        mesh = document.add_mesh(piece.name, piece.points_m, normals, piece.faces, materials[key])
        place, turn = places[:, column], gltf.quaternions(turns[:, column])
        pose = {"translation": place[0].tolist(), "rotation": turn[0].tolist()}
        node = document.add_node({"name": piece.name, "mesh": mesh, **pose})
        if np.ptp(place, axis=0).max() > _STILL_M:
            clip.add(node, "translation", place)
        if np.ptp(turn, axis=0).max() > _STILL:
            clip.add(node, "rotation", turn)


def _poses(result: Result, qpos: Array, bodies: list[int]) -> tuple[Array, Array]:
    """Places (T, P, 3), y up, and orientations (T, P, 4), wxyz, of bodies; of one frame if all are fixed."""
    frames = qpos if result.model.body_weldid[bodies].any() else qpos[:1]
    places, quats = np.empty((len(frames), len(bodies), 3)), np.empty((len(frames), len(bodies), 4))
    for frame, data in enumerate(posed(result.model, frames)):
        places[frame], quats[frame] = data.xpos[bodies], data.xquat[bodies]
    return places @ TO_Y_UP.T, rotations.multiply(rotations.from_matrix(TO_Y_UP), quats)
