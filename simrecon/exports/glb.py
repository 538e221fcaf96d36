"""GLB (glTF 2.0 in one file): the person's own skin on their skeleton, moving, with floor and items.

Metres, y up, the world of the result turned as in the other formats. The skin is simrecon's own, in the
person's shape and drawn out to their bones; a body model that the user brought is not in the file.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from simrecon import __version__
from simrecon.body import clothed
from simrecon.body.clothed import Skin
from simrecon.exports import gltf, rigs, scenery
from simrecon.exports.axes import TO_Y_UP
from simrecon.exports.gltf import Clip, Document
from simrecon.exports.view import ResultView
from simrecon.geometry import rotations
from simrecon.results import Result, kinematic
from simrecon.types import Array, Body, IntArray

SKIN_RGB = np.array([0.72, 0.74, 0.78])
PERSON, MOTION = "person", "motion"
_INFLUENCES = 4


def write(view: ResultView) -> dict[str, bytes]:
    """The motion; at the result's own frames, that of the person with the forces of contact as arrays."""
    document = Document(f"simrecon {__version__}")
    names = rigs.names(view.choices.rig, view.body.skeleton.names)
    joints = add_person(document, view.body, names)
    times_s, qpos = view.times_s, view.whole_qpos
    if view.is_as_simulated:
        times_s, qpos = view.result.motion.times_s, view.result.motion.qpos
    clip = add_clip(document, MOTION, times_s, qpos, view.body, joints)
    scenery.add(document, view.result, qpos, clip)
    if view.is_as_simulated:
        _add_forces(document, view.result)
    return {"motion.glb": document.binary()}


def add_person(document: Document, body: Body, names: tuple[str, ...] = ()) -> tuple[int, ...]:
    """Add skeleton and skin, in the relaxed stance on the origin.

    Args:
        document: to add to.
        body: the person.
        names: of the nodes of the segments; those of the segments if none are given.

    Returns:
        The node of each segment.
    """
    skin = clothed.skin(body)
    joints = _add_skeleton(document, body, skin, names or body.skeleton.names)
    vertices_m, world = _grounded(skin)
    material = document.add_material("skin", SKIN_RGB, roughness=0.7)
    order, weights = skin.strongest(_INFLUENCES)
    used = np.where(weights > 0, order, 0)
    mesh = document.add_mesh(
        PERSON,
        vertices_m,
        gltf.vertex_normals(vertices_m, skin.faces),
        skin.faces,
        material,
        **document.add_weights(used, weights),
    )
    inverse = document.add_array(np.asarray(np.linalg.inv(world), np.float64))
    bound = document.add(
        "skins", {"joints": list(joints), "inverseBindMatrices": inverse, "skeleton": joints[0]}
    )
    document.add_node({"name": PERSON, "mesh": mesh, "skin": bound})
    return joints


def _add_skeleton(document: Document, body: Body, skin: Skin, names: tuple[str, ...]) -> tuple[int, ...]:
    """Add the segments in the relaxed stance."""
    skeleton, world = body.skeleton, _grounded(skin)[1]
    first = len(document.content.get("nodes", []))
    for segment, name in enumerate(names):
        parent = int(skeleton.parents[segment])
        turn = world[segment, :3, :3] if parent < 0 else skin.axes[parent].T @ skin.axes[segment]
        place = world[segment, :3, 3] if parent < 0 else skeleton.offsets_m[segment]
        entry: dict[str, Any] = {"name": name, "translation": np.asarray(place).tolist()}
        entry["rotation"] = gltf.quaternions(rotations.from_matrix(turn)).tolist()
        if below := np.flatnonzero(skeleton.parents == segment).tolist():
            entry["children"] = [first + child for child in below]
        document.add_node(entry, root=parent < 0)
    return tuple(range(first, first + len(skeleton.names)))


def _grounded(skin: Skin) -> tuple[Array, Array]:
    """Vertices (V, 3), and transforms (S, 4, 4) segment → world, y up, with the soles at height zero."""
    lift = np.array([0.0, 0.0, -skin.vertices_m[:, 2].min()])
    world = np.tile(np.eye(4), (len(skin.axes), 1, 1))
    world[:, :3, :3] = TO_Y_UP @ skin.axes
    world[:, :3, 3] = (skin.origins_m + lift) @ TO_Y_UP.T
    return (skin.vertices_m + lift) @ TO_Y_UP.T, world


def add_clip(
    document: Document, name: str, times_s: Array, qpos: Array, body: Body, joints: tuple[int, ...]
) -> Clip:
    """Add an animation of the person.

    Args:
        document: with the person.
        name: of the animation.
        times_s: (T,).
        qpos: (T, nq) configurations there, the person's coordinates first.
        body: the person.
        joints: nodes of the segments.
    """
    clip = Clip(document, name, times_s - times_s[0])
    quats = qpos[:, 3 : kinematic.coordinates(body)].reshape(len(qpos), -1, 4)  # (T, S, 4)
    local = rotations.multiply(body.skeleton.rest, quats)
    local[:, 0] = rotations.multiply(rotations.from_matrix(TO_Y_UP), quats[:, 0])
    clip.add(joints[0], "translation", qpos[:, :3] @ TO_Y_UP.T)
    for segment, node in enumerate(joints):
        clip.add(node, "rotation", gltf.quaternions(local[:, segment]))
    return clip


def _add_forces(document: Document, result: Result) -> None:
    """Add the forces on the parts that the scene pushes, as `extras` of the scene (docs/formats.md)."""
    motion = result.motion
    pushed: IntArray = np.flatnonzero(np.abs(motion.contact_force_N).max(axis=(0, 2)) > 0)
    extras: dict[str, Any] = {
        "up": "y",
        "unit": "m",
        "contact_body": [motion.contact_body[c] for c in pushed],
    }
    if pushed.size:
        force_N = motion.contact_force_N[:, pushed] @ TO_Y_UP.T  # (T, C, 3)
        place_m = np.nan_to_num(motion.contact_point_m[:, pushed] @ TO_Y_UP.T)
        extras["contact_force_N"] = document.add_array(force_N.reshape(-1, 3))
        extras["contact_point_m"] = document.add_array(place_m.reshape(-1, 3))
    document.content["scenes"][0]["extras"] = {"simrecon": extras}
