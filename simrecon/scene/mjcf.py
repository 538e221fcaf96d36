"""The MJCF of a person in a scene.

Things come after the person, so the person's coordinates are the first of `qpos` and `qvel`
(`rollout.person`).
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from simrecon.errors import InputError
from simrecon.scene import parts
from simrecon.scene.parts import Part, Sheet
from simrecon.types import Friction, Ground, Scene, SceneItem

GROUND_GEOM = "ground"
ITEM_PREFIX = "item/"
SLAB_HALF_M, SLAB_DEPTH_M = 50.0, 0.5
"""A compliant floor is a slab of this half length and half thickness."""

# Torsional and rolling friction, metres; MuJoCo's defaults (documentation, XML reference, geom/friction).
_SPIN_FRICTION_M, _ROLL_FRICTION_M = 0.005, 0.0001
# Contacts with sprung surfaces are all but hard: the spring is what gives way, not the contact.
_HARD_SOLIMP = (0.9999, 0.99999, 0.001, 0.5, 2.0)
_SLAB_LEAST_KG, _SLAB_MOST_KG = 0.3, 2.0
_GRAVITY_COMPENSATED = 1.0
_SHEET_RGBA = (0.28, 0.38, 0.52, 1.0)
_GEOM = mujoco.mjtGeom


def build(body_mjcf: str, scene: Scene, timestep_s: float) -> str:
    """MJCF of a person in a scene; it loads alone.

    Options come from the body's MJCF, apart from the time step, which keeps all its digits. Contacts with the
    scene take the scene's friction (priority 1): MuJoCo would otherwise use the larger one of the two geoms.
    The scene's solref and solimp are those of the main default class of the body's MJCF, but for sprung
    surfaces, whose contacts are all but hard.

    Args:
        body_mjcf: the person alone.
        scene: floor and things.
        timestep_s: of the simulation.

    Raises:
        InputError: a mesh can't be used, or the ground's stiffness is still to be found.
    """
    spec = mujoco.MjSpec.from_string(body_mjcf)
    load = float(mujoco.MjModel.from_xml_string(body_mjcf).body_mass.sum())
    _add_ground(spec, scene.ground, timestep_s, load)
    for item in scene.items:
        _add_item(spec, item, scene, timestep_s)
    spec.option.timestep = timestep_s
    spec.compile()
    return _with_timestep(spec.to_xml(), timestep_s)


def owner(geom: str, scene: Scene) -> str | None:
    """Name of the thing that a geom belongs to, `ground`, or None for a part of the person."""
    if geom == GROUND_GEOM:
        return GROUND_GEOM
    if geom.startswith(ITEM_PREFIX):
        name = geom.removeprefix(ITEM_PREFIX)
        found = [item.name for item in scene.items if name == item.name or name.startswith(f"{item.name}/")]
        return max(found, key=len, default=None)
    return None


def spring_damping_Nspm(
    stiffness_Npm: float, damping_Nspm: float, mass_kg: float, timestep_s: float, load_kg: float = math.inf
) -> float:
    """Joint damping with which a simulated spring has the damping asked for.

    The `discrete` integrator takes spring and damper at the end of the step,
    (m + h c' + h² k) v' = m v - h k q, which damps like h k more. A swing of load M and surface m decays per
    step by sqrt((M + m) / (M + m + h c' + h² k)); that this is exp(-c h / 2 M), as in continuous time, gives
    c', which may be negative. The surface alone is stable for 4 m + 2 h (c' + h k) > h² k; where what is
    asked for lies under that, the damping is the least that is stable.

    Args:
        stiffness_Npm: k of the spring.
        damping_Nspm: c asked for.
        mass_kg: m of the surface.
        timestep_s: h.
        load_kg: M, of the person.
    """
    least = max(0.0, (1.05 * timestep_s**2 * stiffness_Npm - 4 * mass_kg) / (2 * timestep_s))
    exact = damping_Nspm
    if math.isfinite(load_kg):
        growth = min(damping_Nspm * timestep_s / load_kg, 1.0)
        exact *= (1 + mass_kg / load_kg) * math.expm1(growth) / growth if growth > 0 else 1.0
    return max(exact, least) - timestep_s * stiffness_Npm


def slab_kg(ground: Ground, timestep_s: float) -> float:
    """Mass of a compliant floor: light, but stable on its own with the damping asked for."""
    stiffness, damping = ground.stiffness_Npm or 0.0, ground.damping_Nspm or 0.0
    needed = (timestep_s**2 * stiffness - 2 * timestep_s * damping) / 4
    return min(max(_SLAB_LEAST_KG, 1.1 * needed), _SLAB_MOST_KG)


def hard_floor(scene: Scene) -> Scene:
    """The scene with a hard floor where its stiffness is still to be found; another as it is."""
    if not scene.ground.calibrate:
        return scene
    return replace(scene, ground=replace(scene.ground, calibrate=False))


def _contact(friction: Friction) -> dict[str, Any]:
    """Attributes of a geom of the scene."""
    spin, roll = friction.torsional_m, friction.rolling_m
    dims = 3 if spin is None else 4 if roll is None else 6
    values = [
        friction.sliding,
        _SPIN_FRICTION_M if spin is None else spin,
        _ROLL_FRICTION_M if roll is None else roll,
    ]
    return {"contype": 1, "conaffinity": 1, "condim": dims, "priority": 1, "friction": values}


def _hard(timestep_s: float) -> dict[str, Any]:
    """Contact that settles as fast as it can without ringing or adding inertia: the spring gives way.

    Measured with a block of 70 kg on 20 and 50 kN/m: at a time constant of one step its weight sank it 7 to
    80 per cent too far, at five it rebounded 20 per cent too high.
    """
    return {"solimp": _HARD_SOLIMP, "solref": [1.5 * timestep_s, 1.0]}


def _add_ground(spec: mujoco.MjSpec, ground: Ground, timestep_s: float, load_kg: float) -> None:
    pose: dict[str, Any] = {"pos": [0.0, 0.0, ground.height_m]}
    if ground.slope_rad:
        pose["quat"] = _sloped(ground)
    if ground.calibrate:
        raise InputError('[ground] stiffness_Npm = "fit" is found by `simrecon run`; give a number here')
    if ground.stiffness_Npm is None:
        plane = {"type": _GEOM.mjGEOM_PLANE, "size": [0.0, 0.0, 0.05]}
        spec.worldbody.add_geom(name=GROUND_GEOM, **plane, **pose, **_contact(ground.friction))
        return
    mass = slab_kg(ground, timestep_s)
    body = spec.worldbody.add_body(name=GROUND_GEOM, gravcomp=_GRAVITY_COMPENSATED, **pose)
    stiffness, damping = ground.stiffness_Npm, ground.damping_Nspm or 0.0
    body.add_joint(
        name=GROUND_GEOM,
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=[0.0, 0.0, 1.0],
        stiffness=np.array([stiffness, 0, 0]),
        damping=np.array([spring_damping_Nspm(stiffness, damping, mass, timestep_s, load_kg), 0, 0]),
    )
    body.add_geom(
        name=GROUND_GEOM,
        type=_GEOM.mjGEOM_BOX,
        pos=[0.0, 0.0, -SLAB_DEPTH_M],
        size=[SLAB_HALF_M, SLAB_HALF_M, SLAB_DEPTH_M],
        mass=mass,
        **_hard(timestep_s),
        **_contact(ground.friction),
    )


def _sloped(ground: Ground) -> list[float]:
    """Quaternion that tips the plane so that it rises towards `slope_yaw_rad`."""
    half, yaw = -ground.slope_rad / 2, ground.slope_yaw_rad
    return [math.cos(half), -math.sin(half) * math.sin(yaw), math.sin(half) * math.cos(yaw), 0.0]


def _add_item(spec: mujoco.MjSpec, item: SceneItem, scene: Scene, timestep_s: float) -> None:
    name = ITEM_PREFIX + item.name
    x, y, z = item.position_m
    quat = [math.cos(item.yaw_rad / 2), 0.0, 0.0, math.sin(item.yaw_rad / 2)]
    cos, sin = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
    solid = parts.solid(item, scene.folder)
    host, whole = spec.worldbody, sum(part.volume_m3 for part in solid)
    if item.mass_kg is not None:
        host = spec.worldbody.add_body(name=name, pos=[x, y, z], quat=quat)
        host.add_freejoint(name=name)
    for part in solid:
        px, py, pz = (float(value) for value in _origin(part))
        pose: dict[str, Any] = {
            "pos": [x + cos * px - sin * py, y + sin * px + cos * py, z + pz],
            "quat": quat,
        }
        if item.mass_kg is not None:
            pose = {"pos": [px, py, pz], "mass": item.mass_kg * part.volume_m3 / whole}
        label = f"{name}/{part.name}" if part.name else name
        host.add_geom(name=label, **_shape(spec, label, part), **pose, **_contact(item.friction))
    sheet = parts.sheet(item)
    if sheet is not None:
        carrier = spec.worldbody.add_frame(pos=[x, y, z], quat=quat)
        _add_sheet(spec, carrier, name, item, scene, sheet, timestep_s)


def _origin(part: Part) -> Any:
    """Where the geom stands in the item's frame: vertices of a hull are given there already."""
    if part.shape == "hull":
        return np.zeros(3)
    if part.shape == "field":
        return part.centre_m - [0.0, 0.0, part.half_m[2]]
    return part.centre_m


def _shape(spec: mujoco.MjSpec, label: str, part: Part) -> dict[str, Any]:
    """Type and size of a part's geom; meshes and fields are added to the assets."""
    if part.shape == "sphere":
        return {"type": _GEOM.mjGEOM_SPHERE, "size": [part.half_m[0], 0.0, 0.0]}
    if part.shape == "hull" and part.vertices_m is not None and part.faces is not None:
        spec.add_mesh(name=label, uservert=part.vertices_m.ravel(), userface=part.faces.ravel())
        return {"type": _GEOM.mjGEOM_MESH, "meshname": label}
    if part.shape == "field" and part.heights_m is not None:
        rows, columns = part.heights_m.shape
        top = max(float(part.heights_m.max()), 1e-3)
        size = [*part.half_m[:2], top, 0.05]
        heights = (part.heights_m / top).ravel()
        spec.add_hfield(name=label, nrow=rows, ncol=columns, size=size, userdata=heights)
        return {"type": _GEOM.mjGEOM_HFIELD, "hfieldname": label}
    return {"type": _GEOM.mjGEOM_BOX, "size": part.half_m.tolist()}


def _add_sheet(
    spec: mujoco.MjSpec,
    frame: Any,
    name: str,
    item: SceneItem,
    scene: Scene,
    sheet: Sheet,
    timestep_s: float,
) -> None:
    """Tiles that slide up and down, coupled by tendons; only the person and movable things touch them."""
    (nx, ny), half = sheet.tiles, [sheet.size_m[i] / sheet.tiles[i] / 2 for i in (0, 1)]
    deep = max(sheet.depth_m, 0.1)
    touch = _contact(item.friction) | {"contype": 0}
    held = np.diag(sheet.matrix()) - _neighbours(sheet)
    total = np.diag(sheet.matrix()) + _neighbours(sheet)  # bounds the highest eigenvalue (Gershgorin)
    # the damping over stiffness is the same for all springs, so one correction serves all
    ratio = _damping_ratio_s(sheet, float(total.max()), timestep_s)
    for i in range(nx):
        for j in range(ny):
            label = f"{name}/tile_{i}_{j}"
            centre = [(2 * i + 1 - nx) * half[0], (2 * j + 1 - ny) * half[1], float(sheet.centre_m[2])]
            body = spec.worldbody.add_body(name=label, pos=centre, gravcomp=_GRAVITY_COMPENSATED)
            body.set_frame(frame)
            spring = float(held[i * ny + j])
            body.add_joint(
                name=label,
                type=mujoco.mjtJoint.mjJNT_SLIDE,
                axis=[0.0, 0.0, 1.0],
                range=[-sheet.depth_m, 10.0 * sheet.depth_m],
                limited=mujoco.mjtLimited.mjLIMITED_TRUE,
                stiffness=np.array([spring, 0, 0]),
                damping=np.array([ratio * spring, 0, 0]),
            )
            shown = 0.02 if any(sheet.tension_Npm) else sheet.depth_m
            body.add_geom(
                name=label,
                type=_GEOM.mjGEOM_BOX,
                pos=[0.0, 0.0, -deep / 2],
                size=[*half, deep / 2],
                mass=sheet.tile_kg,
                **_hard(timestep_s),
                rgba=[0.5, 0.5, 0.5, 0.0],
                **touch,
            )
            body.add_geom(
                name=f"{label}/top",
                type=_GEOM.mjGEOM_BOX,
                pos=[0.0, 0.0, -shown / 2],
                size=[*half, shown / 2],
                mass=0.0,
                contype=0,
                conaffinity=0,
                rgba=_SHEET_RGBA,
            )
            spec.add_exclude(name=f"{label}/world", bodyname1="world", bodyname2=label)
            if scene.ground.stiffness_Npm is not None:
                spec.add_exclude(name=f"{label}/ground", bodyname1=GROUND_GEOM, bodyname2=label)
    _add_tension(spec, name, sheet, ratio)


def _neighbours(sheet: Sheet) -> Any:
    """Sum of the tensions of every tile towards its neighbours, (n,)."""
    matrix = sheet.matrix()
    return np.diag(matrix) - matrix.sum(axis=1)


def _damping_ratio_s(sheet: Sheet, total_Npm: float, timestep_s: float) -> float:
    """`spring_damping_Nspm` over stiffness, for the stiffest motion of the tiles."""
    damping = spring_damping_Nspm(total_Npm, sheet.damping_s * total_Npm, sheet.tile_kg, timestep_s)
    return damping / total_Npm


def _add_tension(spec: mujoco.MjSpec, name: str, sheet: Sheet, ratio_s: float) -> None:
    (nx, ny), tension = sheet.tiles, sheet.tension_Npm
    if not any(tension):
        return
    for i in range(nx):
        for j in range(ny):
            for axis, (k, m) in enumerate(((i + 1, j), (i, j + 1))):
                if k < nx and m < ny:
                    tendon = spec.add_tendon(
                        name=f"{name}/pull_{i}_{j}_{'xy'[axis]}",
                        stiffness=np.array([tension[axis], 0, 0]),
                        damping=np.array([ratio_s * tension[axis], 0, 0]),
                        springlength=[0.0, 0.0],
                    )
                    tendon.wrap_joint(f"{name}/tile_{i}_{j}", 1.0)
                    tendon.wrap_joint(f"{name}/tile_{k}_{m}", -1.0)


def _with_timestep(mjcf: str, timestep_s: float) -> str:
    """Put the time step back in full: MuJoCo prints six digits."""
    root = ElementTree.fromstring(mjcf)
    option = root.find("option")
    if option is None:
        option = ElementTree.SubElement(root, "option")
    option.set("timestep", repr(float(timestep_s)))
    return ElementTree.tostring(root, encoding="unicode") + "\n"
