"""Clearance and centre of mass of a body that is known by its joints, or by a simulator's configuration.

Motions that are nothing but joints (an estimate, a reference, another method) get capsules around their
bones, and their feet as they rest in the reference, so that all stand in one table; a simulated body has its
own primitives.
Axes: T frames, K joints, C parts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import mujoco
import numpy as np

from simrecon import resources
from simrecon import scene as scenes
from simrecon.metrics.contact import (
    CONTACT_HEIGHT_M,
    CONTACT_PERCENTILE,
    SKATE_SPEED_MPS,
    Flags,
    box_clearance,
    steps,
)
from simrecon.metrics.truth import FOOT_POINTS
from simrecon.types import Array, Scene

_SAMPLES = np.linspace(0.0, 1.0, 5)  # along a bone; the ends decide over a plane
_DISTANCE_MAX_M = 1.0
_HFIELD = int(mujoco.mjtGeom.mjGEOM_HFIELD)
_SOLE = np.array([[1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, -1.0], [-1.0, 1.0, -1.0]])
FEET = ("left_foot", "right_foot")
"""Primitives that are feet."""


@dataclass(frozen=True, eq=False)
class Bones:
    """Capsules around bones, C parts.

    Attributes:
        names: of the parts; those of FOOT_POINTS are points.
        starts, ends: joints whose middle is an end, by part.
        radii_m: (C,); for foot points the height at which they rest in the reference.
        along: (C, 2) where on the way from start to end the capsule begins and ends.
        behind_m: (C,) how far its axis lies behind the bone, as the trunk faces.
    """

    names: tuple[str, ...]
    starts: tuple[tuple[str, ...], ...]
    ends: tuple[tuple[str, ...], ...]
    radii_m: Array
    along: Array
    behind_m: Array


@cache
def _data() -> dict[str, Any]:
    return resources.toml("models", "body", "centre_of_mass.toml")


@cache
def _radii() -> dict[str, float]:
    entries = resources.toml("models", "body", "primitives.toml")["primitive"]
    return {entry["name"]: float(entry["radius"]) for entry in entries if "radius" in entry}


def stature_m(names: Sequence[str], joints_m: Array) -> float:
    """Stature from the median length of thigh and shank (Winter 2009, fig. 4.1).

    Args:
        names: K names with hips, knees and ankles.
        joints_m: (T, K, 3).
    """
    at = {name: joints_m[:, k] for k, name in enumerate(names)}
    lengths = [
        np.median(np.linalg.norm(at[f"{side}_{a}"] - at[f"{side}_{b}"], axis=-1))
        for side in ("left", "right")
        for a, b in (("hip", "knee"), ("knee", "ankle"))
    ]
    return float(np.sum(lengths) / 2 / _data()["stature"]["leg"])


def capsule_primitives() -> tuple[str, ...]:
    """Names of the primitives whose radii the capsules have."""
    return tuple(entry["primitive"] for entry in _data()["capsule"])


def bones(
    names: Sequence[str], truth_m: Array, scene: Scene, radii_m: Mapping[str, float] | None = None
) -> Bones:
    """Capsules that every motion of a clip gets, set by its reference.

    Args:
        names: K names of the reference, with the body's 12 joints.
        truth_m: (T, K, 3) the reference.
        scene: what the person may touch.
        radii_m: of the person's primitives; None: those of an average person of the reference's stature.

    Returns:
        The capsules of `models/body/centre_of_mass.toml`, and the foot points that are there; those rest at
        the 5th percentile of their distance to the scene.
    """
    stature = stature_m(names, truth_m)
    if radii_m is None:
        radii_m = {name: stature * radius for name, radius in _radii().items()}
    entries = [side for entry in _data()["capsule"] for side in _sides(entry)]
    feet = [point for point in FOOT_POINTS if point in names]
    rest = [
        float(np.percentile(over(scene, truth_m[:, list(names).index(point)]), CONTACT_PERCENTILE))
        for point in feet
    ]
    radii = [radii_m[entry["primitive"]] for entry in entries]
    return Bones(
        (*(entry["name"] for entry in entries), *feet),
        (*(tuple(entry["from"]) for entry in entries), *((point,) for point in feet)),
        (*(tuple(entry["to"]) for entry in entries), *((point,) for point in feet)),
        np.array(radii + rest),
        np.array([entry.get("along", [0.0, 1.0]) for entry in entries] + [[0.0, 1.0]] * len(feet)),
        np.array([stature * entry.get("behind", 0.0) for entry in entries] + [0.0] * len(feet)),
    )


def bone_clearance(parts: Bones, names: Sequence[str], joints_m: Array, scene: Scene) -> Array:
    """Distance of each capsule to the nearest thing of the scene, negative inside; (T, K, 3) → (T, C)."""
    at = {name: joints_m[:, k] for k, name in enumerate(names)}
    start, end = (  # (T, C, 3)
        np.stack([np.mean([at[joint] for joint in part], axis=0) for part in ends], axis=1)
        for ends in (parts.starts, parts.ends)
    )
    way = parts.along[:, :1] + _SAMPLES * np.diff(parts.along, axis=1)  # (C, 5)
    points = start[..., None, :] + way[..., None] * (end - start)[..., None, :]  # (T, C, 5, 3)
    points -= parts.behind_m[:, None, None] * _ahead(at)[..., None, None, :]
    return np.asarray(over(scene, points).min(-1) - parts.radii_m)


def _ahead(at: Mapping[str, Array]) -> Array:
    """Unit vectors (T, 3) in which the trunk faces."""
    left, right = (at[f"{side}_hip"] for side in ("left", "right"))
    up = at["left_shoulder"] + at["right_shoulder"] - left - right
    ahead = np.cross(left - right, up)
    return np.asarray(ahead / np.maximum(np.linalg.norm(ahead, axis=-1, keepdims=True), 1e-9))


def touching(
    parts: Bones, names: Sequence[str], joints_m: Array, clearance: Array, interval_s: float
) -> Flags:
    """Which parts touch their support, (T, C): those within 3 cm of it.

    Heels and toes, which swing past as near as that, must also be slower than 0.5 m/s, by the frame they
    arrive at; the first frame takes the speed of the second.

    Args:
        parts: C capsules.
        names: K names.
        joints_m: (T, K, 3).
        clearance: (T, C) from `bone_clearance`.
        interval_s: between frames.
    """
    feet = [k for k, part in enumerate(parts.names) if part in FOOT_POINTS]
    points = joints_m[:, [list(names).index(parts.names[k]) for k in feet]]  # (T, F, 3)
    speed = steps(points) / interval_s  # (T-1, F)
    near = clearance < CONTACT_HEIGHT_M
    near[:, feet] &= np.concatenate((speed[:1], speed)) < SKATE_SPEED_MPS
    return np.asarray(near)


def centre_of_mass(names: Sequence[str], joints_m: Array) -> Array:
    """Centre of mass from the body's 12 joints, (..., K, 3) → (..., 3).

    Segment masses and centres of de Leva 1996 (`models/body/mass.toml`, `centre_of_mass.toml`).
    """
    at = {name: joints_m[..., k, :] for k, name in enumerate(names)}
    percent = resources.toml("models", "body", "mass.toml")["percent"]
    total, moment = 0.0, np.zeros((*joints_m.shape[:-2], 3))
    for entry in (side for given in _data()["segment"] for side in _sides(given)):
        mass = sum(percent[part] for part in entry["mass"])
        start, end = (np.mean([at[joint] for joint in entry[key]], axis=0) for key in ("from", "to"))
        moment += mass * (start + entry["at"] * (end - start))
        total += mass
    return np.asarray(moment / total)


def _sides(entry: dict[str, Any]) -> list[dict[str, Any]]:
    """An entry and, where its name starts with `left_`, that of the other side."""
    if not entry["name"].startswith("left_"):
        return [entry]
    other = {"name": entry["name"].replace("left_", "right_", 1)}
    other |= {key: [joint.replace("left_", "right_", 1) for joint in entry[key]] for key in ("from", "to")}
    return [entry, entry | other]


def over(scene: Scene, points_m: Array) -> Array:
    """Distance to the nearest thing of the scene, (..., 3) → (...)."""
    return np.asarray(scenes.distances(scene, points_m)[0].min(axis=0))


@dataclass(frozen=True, eq=False)
class Configurations:
    """What a body's configurations (T, nq) say.

    Attributes:
        points_m: (T, K, 3) sites; com_m: (T, 3); com_velocity_mps: (T, 3), zero without velocities.
        floor_m: (T, C) signed distance of each part to the ground, at most one metre.
        scene_m: (T, C) to the nearest thing of the scene, the ground too; height fields and sprung sheets,
            to which MuJoCo measures no distance, are left out.
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
    data = mujoco.MjData(model)
    geoms = [model.geom(name).id for name in parts]
    ground = model.geom(scenes.GROUND_GEOM).id
    items = [
        i
        for i in range(model.ngeom)
        if model.geom(i).name.startswith(scenes.ITEM_PREFIX) and model.geom_type[i] != _HFIELD
    ]
    sites, boxes = [model.site(name).id for name in points], [model.geom(name).id for name in FEET]
    person = int(model.jnt_bodyid[0])
    found = []
    for frame, configuration in enumerate(qpos):
        data.qpos[:] = configuration
        data.qvel[:] = 0.0 if qvel is None else qvel[frame]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_subtreeVel(model, data)
        floor, *others = (
            [mujoco.mj_geomDistance(model, data, thing, geom, _DISTANCE_MAX_M, None) for geom in geoms]
            for thing in (ground, *items)
        )
        feet, corners, soles = _feet(
            scene, model.geom_size[boxes], data.geom_xpos[boxes], data.geom_xmat[boxes]
        )
        com = (data.subtree_com[person].copy(), data.subtree_linvel[person].copy())
        clearance = (floor, np.min([floor, *others], axis=0))
        found.append((data.site_xpos[sites], *com, *clearance, feet, corners, soles))
    return Configurations(*(np.array(column) for column in zip(*found, strict=True)))


def _feet(scene: Scene, half_size: Array, position: Array, matrix: Array) -> tuple[Array, Array, Array]:
    """`feet_m` (2,), `corners_m` (8, 3) and `soles_m` (8,) of one frame, from the feet's boxes."""
    axes = matrix.reshape(-1, 3, 3)
    feet = box_clearance(position, axes, half_size, scenes.support_height(scene, position[:, :2]))
    offsets = half_size[:, None] * _SOLE  # (2, 4, 3)
    corners = (position[:, None] + offsets @ np.swapaxes(axes, -1, -2)).reshape(-1, 3)  # (8, 3)
    return feet, corners, np.asarray(corners[:, 2] - scenes.support_height(scene, corners[:, :2]))
