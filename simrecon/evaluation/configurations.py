"""What the configurations of a body show: points, centre of mass, and clearance of its own primitives.

Axes: T frames, K points, C parts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from simrecon import scene as scenes
from simrecon.body.primitives import FEET
from simrecon.metrics.clearance import box_clearance
from simrecon.sim.address import locate
from simrecon.sim.poses import at_rest, posed
from simrecon.types import Array, IntArray, Scene

_DISTANCE_MAX_M = 1.0
_HFIELD = int(mujoco.mjtGeom.mjGEOM_HFIELD)
_SOLE = np.array([[1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, -1.0], [-1.0, 1.0, -1.0]])


@dataclass(frozen=True, eq=False)
class Configurations:
    """What a body's configurations (T, nq) show.

    Attributes:
        points_m: (T, K, 3) sites; com_m: (T, 3); com_velocity_mps: (T, 3), zero without velocities.
        floor_m: (T, C) signed distance of each part to the ground, at most one metre.
        scene_m: (T, C) to the nearest item of the scene or the ground; height fields and sprung sheets, to
            which MuJoCo measures no distance, are left out.
        feet_m: (T, 2) height of the lowest corner of each foot over what is under its centre.
        corners_m: (T, 8, 3) corners of both soles; soles_m: (T, 8) their height over what is under them.
    """

    points_m: Array
    com_m: Array
    com_velocity_mps: Array
    floor_m: Array
    scene_m: Array
    feet_m: Array
    corners_m: Array
    soles_m: Array


def configurations(
    model: mujoco.MjModel,
    scene: Scene,
    qpos: Array,
    parts: Sequence[str],
    points: Sequence[str],
    qvel: Array | None = None,
) -> Configurations:
    """Clearances of the primitives themselves.

    Args:
        model: body and scene, as in `model.xml`.
        scene: of the same run.
        qpos: (T, nq).
        parts: C names of geoms of the body.
        points: K names of sites.
        qvel: (T, nv), or None.
    """
    person = locate(model)
    geoms, boxes, sites = person.geoms(model, parts), person.geoms(model, FEET), person.sites(model, points)
    supports = [model.geom(scenes.GROUND_GEOM).id, *_items(model)]
    rows = []
    for data in posed(model, qpos, qvel):
        floor, *others = (
            [mujoco.mj_geomDistance(model, data, support, geom, _DISTANCE_MAX_M, None) for geom in geoms]
            for support in supports
        )
        feet = _feet(scene, model.geom_size[boxes], data.geom_xpos[boxes], data.geom_xmat[boxes])
        com = (data.subtree_com[person.body].copy(), data.subtree_linvel[person.body].copy())
        rows.append((data.site_xpos[sites], *com, floor, np.min([floor, *others], axis=0), *feet))
    return Configurations(*(np.array(column) for column in zip(*rows, strict=True)))


def foot_rest(model: mujoco.MjModel) -> dict[str, float]:
    """Height of the sites of heels and toes over the sole of the foot's box, m, by name."""
    data, heights = at_rest(model), {}
    for foot in FEET:
        box, side = model.geom(foot).id, foot.split("_")[0]
        for point in (f"{side}_heel", f"{side}_toe"):
            offset = data.site(point).xpos - data.geom_xpos[box]
            heights[point] = float(data.geom_xmat[box].reshape(3, 3)[:, 2] @ offset + model.geom_size[box, 2])
    return heights


def _items(model: mujoco.MjModel) -> IntArray:
    """Geoms of the scene's items, but for height fields, to which MuJoCo measures no distance."""
    named = [model.geom(i).name.startswith(scenes.ITEM_PREFIX) for i in range(model.ngeom)]
    return np.flatnonzero(np.array(named) & (model.geom_type != _HFIELD))


def _feet(scene: Scene, half_size: Array, position: Array, matrix: Array) -> tuple[Array, Array, Array]:
    """`feet_m` (2,), `corners_m` (8, 3) and `soles_m` (8,) of one frame, from the feet's boxes."""
    axes = matrix.reshape(-1, 3, 3)
    feet = box_clearance(position, axes, half_size, scenes.support_height(scene, position[:, :2]))
    offsets = half_size[:, None] * _SOLE  # (2, 4, 3)
    corners = (position[:, None] + offsets @ np.swapaxes(axes, -1, -2)).reshape(-1, 3)  # (8, 3)
    return feet, corners, np.asarray(corners[:, 2] - scenes.support_height(scene, corners[:, :2]))
