"""A sprung sheet in MJCF: tiles that slide up and down, coupled by tendons."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from simrecon.scene.mjcf import contact, springs
from simrecon.scene.mjcf.names import GROUND_GEOM
from simrecon.scene.sheets import Sheet
from simrecon.types import Array, Friction

_SHEET_RGBA = (0.28, 0.38, 0.52, 1.0)
_MEMBRANE_M = 0.02
"""Thickness of a membrane in pictures."""


def add(
    spec: mujoco.MjSpec,
    frame: Any,
    name: str,
    sheet: Sheet,
    friction: Friction,
    timestep_s: float,
    *,
    on_slab: bool,
) -> None:
    """Add the tiles of a sheet to a model; only the person and movable items touch them.

    Args:
        spec: the model, which is changed.
        frame: of the item, in the world.
        name: of the item in the model.
        sheet: of the item.
        friction: of the item.
        timestep_s: of the simulation.
        on_slab: whether the floor is a slab on a spring, which the tiles don't touch either.
    """
    nx, ny = sheet.tiles
    neighbours = _neighbours(sheet)
    own = np.diag(sheet.matrix()) - neighbours  # (n,) spring of each tile
    total = np.diag(sheet.matrix()) + neighbours  # bounds the highest eigenvalue (Gershgorin)
    # the damping over stiffness is the same for all springs, so one correction serves all
    ratio = _damping_ratio_s(sheet, float(total.max()), timestep_s)
    surface = contact.hard(timestep_s) | contact.rubbing(friction) | {"contype": 0}
    for i in range(nx):
        for j in range(ny):
            label = f"{name}/tile_{i}_{j}"
            body = spec.worldbody.add_body(
                name=label, pos=_centre(sheet, i, j), gravcomp=springs.GRAVITY_COMPENSATED
            )
            body.set_frame(frame)
            _fill(body, label, sheet, float(own[i * ny + j]), ratio, surface)
            spec.add_exclude(name=f"{label}/world", bodyname1="world", bodyname2=label)
            if on_slab:
                spec.add_exclude(name=f"{label}/ground", bodyname1=GROUND_GEOM, bodyname2=label)
    _add_tension(spec, name, sheet, ratio)


def _fill(
    body: mujoco.MjsBody, label: str, sheet: Sheet, spring_Npm: float, ratio_s: float, surface: dict[str, Any]
) -> None:
    """Joint and geoms of a tile: an invisible block that is touched, and a visible top that is not."""
    body.add_joint(
        name=label,
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=[0.0, 0.0, 1.0],
        range=[-sheet.depth_m, 10.0 * sheet.depth_m],
        limited=mujoco.mjtLimited.mjLIMITED_TRUE,
        stiffness=np.array([spring_Npm, 0, 0]),
        damping=np.array([ratio_s * spring_Npm, 0, 0]),
    )
    half, deep = _half_m(sheet), max(sheet.depth_m, 0.1)
    body.add_geom(
        name=label,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=[0.0, 0.0, -deep / 2],
        size=[*half, deep / 2],
        mass=sheet.tile_kg,
        rgba=[0.5, 0.5, 0.5, 0.0],
        **surface,
    )
    visible = _MEMBRANE_M if any(sheet.tension_Npm) else sheet.depth_m
    body.add_geom(
        name=f"{label}/top",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=[0.0, 0.0, -visible / 2],
        size=[*half, visible / 2],
        mass=0.0,
        contype=0,
        conaffinity=0,
        rgba=_SHEET_RGBA,
    )


def _half_m(sheet: Sheet) -> list[float]:
    """Half sizes of a tile along x and y."""
    return [sheet.size_m[i] / sheet.tiles[i] / 2 for i in (0, 1)]


def _centre(sheet: Sheet, i: int, j: int) -> list[float]:
    """Centre of a tile's upper side in the item's frame (3,)."""
    (nx, ny), half = sheet.tiles, _half_m(sheet)
    return [(2 * i + 1 - nx) * half[0], (2 * j + 1 - ny) * half[1], float(sheet.centre_m[2])]


def _neighbours(sheet: Sheet) -> Array:
    """Sum of the tensions of every tile towards its neighbours, (n,)."""
    matrix = sheet.matrix()
    return np.asarray(np.diag(matrix) - matrix.sum(axis=1))


def _damping_ratio_s(sheet: Sheet, total_Npm: float, timestep_s: float) -> float:
    """`springs.joint_damping_Nspm` over stiffness, for the stiffest motion of the tiles."""
    damping = springs.joint_damping_Nspm(total_Npm, sheet.damping_s * total_Npm, sheet.tile_kg, timestep_s)
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
