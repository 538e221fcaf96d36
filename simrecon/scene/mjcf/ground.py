"""The floor in MJCF: a plane, or a slab on a spring where it is compliant."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from simrecon.errors import InputError
from simrecon.scene.mjcf import contact, springs
from simrecon.scene.mjcf.names import GROUND_GEOM
from simrecon.types import Ground, Scene

SLAB_HALF_M, SLAB_DEPTH_M = 50.0, 0.5
"""Half length and half thickness of the slab that is a compliant floor."""
_SLAB_LEAST_KG, _SLAB_MOST_KG = 0.3, 2.0


def hard_floor(scene: Scene) -> Scene:
    """The scene with a hard floor where its stiffness is still to be fitted; any other scene as it is."""
    if not scene.ground.calibrate:
        return scene
    return replace(scene, ground=replace(scene.ground, calibrate=False))


def add(spec: mujoco.MjSpec, ground: Ground, timestep_s: float, load_kg: float) -> None:
    """Add the floor to a model.

    Args:
        spec: the model, which is changed.
        ground: the floor.
        timestep_s: of the simulation.
        load_kg: mass of the person.

    Raises:
        InputError: its stiffness is still to be fitted.
    """
    pose: dict[str, Any] = {"pos": [0.0, 0.0, ground.height_m]}
    if ground.slope_rad:
        pose["quat"] = _sloped(ground)
    if ground.calibrate:
        raise InputError('[ground] stiffness_Npm = "fit" is found by `simrecon run`; give a number here')
    if ground.stiffness_Npm is None:
        plane = {"type": mujoco.mjtGeom.mjGEOM_PLANE, "size": [0.0, 0.0, 0.05]}
        spec.worldbody.add_geom(name=GROUND_GEOM, **plane, **pose, **contact.rubbing(ground.friction))
        return
    mass = _slab_kg(ground, timestep_s)
    body = spec.worldbody.add_body(name=GROUND_GEOM, gravcomp=springs.GRAVITY_COMPENSATED, **pose)
    stiffness, damping = ground.stiffness_Npm, ground.damping_Nspm or 0.0
    body.add_joint(
        name=GROUND_GEOM,
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=[0.0, 0.0, 1.0],
        stiffness=np.array([stiffness, 0, 0]),
        damping=np.array([springs.joint_damping_Nspm(stiffness, damping, mass, timestep_s, load_kg), 0, 0]),
    )
    body.add_geom(
        name=GROUND_GEOM,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=[0.0, 0.0, -SLAB_DEPTH_M],
        size=[SLAB_HALF_M, SLAB_HALF_M, SLAB_DEPTH_M],
        mass=mass,
        **contact.hard(timestep_s),
        **contact.rubbing(ground.friction),
    )


def _slab_kg(ground: Ground, timestep_s: float) -> float:
    """Mass of a compliant floor: light, but stable on its own with its damping."""
    stiffness, damping = ground.stiffness_Npm or 0.0, ground.damping_Nspm or 0.0
    needed = (timestep_s**2 * stiffness - 2 * timestep_s * damping) / 4
    return min(max(_SLAB_LEAST_KG, 1.1 * needed), _SLAB_MOST_KG)


def _sloped(ground: Ground) -> list[float]:
    """Quaternion that tips the plane so that it rises towards `slope_yaw_rad`."""
    half, yaw = -ground.slope_rad / 2, ground.slope_yaw_rad
    return [math.cos(half), -math.sin(half) * math.sin(yaw), math.sin(half) * math.cos(yaw), 0.0]
