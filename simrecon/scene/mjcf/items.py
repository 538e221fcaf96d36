"""The items of a scene in MJCF: geoms of the world, or a free body where an item has a mass."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np

from simrecon.scene import sheets, solids
from simrecon.scene.mjcf import contact, tiles
from simrecon.scene.mjcf.names import ITEM_PREFIX
from simrecon.scene.parts import Part
from simrecon.types import Scene, SceneItem


def add(spec: mujoco.MjSpec, item: SceneItem, scene: Scene, timestep_s: float) -> None:
    """Add an item to a model.

    Args:
        spec: the model, which is changed.
        item: of the scene.
        scene: floor and items.
        timestep_s: of the simulation.

    Raises:
        InputError: its mesh can't be used.
    """
    name = ITEM_PREFIX + item.name
    x, y, z = item.position_m
    quat = [math.cos(item.yaw_rad / 2), 0.0, 0.0, math.sin(item.yaw_rad / 2)]
    cos, sin = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
    parts = solids.parts_of(item, scene.folder)
    host, whole = spec.worldbody, sum(part.volume_m3 for part in parts)
    if item.mass_kg is not None:
        host = spec.worldbody.add_body(name=name, pos=[x, y, z], quat=quat)
        host.add_freejoint(name=name)
    for part in parts:
        px, py, pz = (float(value) for value in _origin(part))
        pose: dict[str, Any] = {
            "pos": [x + cos * px - sin * py, y + sin * px + cos * py, z + pz],
            "quat": quat,
        }
        if item.mass_kg is not None:
            pose = {"pos": [px, py, pz], "mass": item.mass_kg * part.volume_m3 / whole}
        label = f"{name}/{part.name}" if part.name else name
        host.add_geom(name=label, **_shape(spec, label, part), **pose, **contact.rubbing(item.friction))
    sheet = sheets.sheet_of(item)
    if sheet is not None:
        carrier = spec.worldbody.add_frame(pos=[x, y, z], quat=quat)
        on_slab = scene.ground.stiffness_Npm is not None
        tiles.add(spec, carrier, name, sheet, item.friction, timestep_s, on_slab=on_slab)


def _origin(part: Part) -> Any:
    """Where the geom stands in the item's frame (3,); the vertices of a hull are in that frame already."""
    if part.shape == "hull":
        return np.zeros(3)
    if part.shape == "field":
        return part.centre_m - [0.0, 0.0, part.half_m[2]]
    return part.centre_m


def _shape(spec: mujoco.MjSpec, label: str, part: Part) -> dict[str, Any]:
    """Type and size of a part's geom; meshes and fields are added to the assets."""
    if part.shape == "sphere":
        return {"type": mujoco.mjtGeom.mjGEOM_SPHERE, "size": [part.half_m[0], 0.0, 0.0]}
    if part.shape == "hull" and part.vertices_m is not None and part.faces is not None:
        spec.add_mesh(name=label, uservert=part.vertices_m.ravel(), userface=part.faces.ravel())
        return {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": label}
    if part.shape == "field" and part.heights_m is not None:
        rows, columns = part.heights_m.shape
        top = max(float(part.heights_m.max()), 1e-3)
        size = [*part.half_m[:2], top, 0.05]
        heights = (part.heights_m / top).ravel()
        spec.add_hfield(name=label, nrow=rows, ncol=columns, size=size, userdata=heights)
        return {"type": mujoco.mjtGeom.mjGEOM_HFIELD, "hfieldname": label}
    return {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": part.half_m.tolist()}
