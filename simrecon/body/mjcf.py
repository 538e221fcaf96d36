"""The person as MJCF: ball joints, motors and primitives; no floor, no scene."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from simrecon import resources
from simrecon.body.skeleton import ROOT, joints
from simrecon.types import Primitive, Skeleton

AXES = "xyz"


def make(skeleton: Skeleton, primitives: tuple[Primitive, ...], mass_kg: float) -> str:
    """MJCF text of the person alone.

    Every joint is a ball joint at the centre of its range, limited by the cone that holds its range, with one
    PD motor per component of its rotation vector. The root is free and nothing drives it.
    """
    spec = mujoco.MjSpec()
    spec.modelname = "simrecon"
    spec.compiler.degree = False
    spec.compiler.autolimits = True
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    _set_solver(spec.option)
    data = resources.toml("models", "body", "mass.toml")
    contact, passive = data["contact"], data["joint"]
    spec.default.geom.solimp = contact["solimp"]
    bodies = _add_segments(spec, skeleton, passive["damping_Nmspradkg"] * mass_kg, passive["armature_kgm2"])
    for primitive in primitives:
        _add_primitive(bodies[primitive.segment], primitive, contact["friction"])
    for point, segment, offset in zip(
        skeleton.point_names, skeleton.point_segments, skeleton.point_offsets_m, strict=True
    ):
        bodies[skeleton.names[segment]].add_site(name=point, pos=offset, size=[0.01, 0, 0], group=4)
    for first, second in contact["exclude"]:
        spec.add_exclude(name=f"{first}-{second}", bodyname1=first, bodyname2=second)
    _add_motors(spec, skeleton, mass_kg)
    text: str = spec.to_xml()
    return text


def _set_solver(option: mujoco.MjOption) -> None:
    """Turn off the solver's warm start and islands, and hold its Jacobian sparse.

    The minimum is the same, and steps are a fifth faster (decision 11): a person is one tree of bodies, so
    that all that it touches makes one island, with few rows in each limb; and at steps of 10 ms the
    accelerations of the step before are further off than those without contacts.
    """
    option.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
    option.disableflags = mujoco.mjtDisableBit.mjDSBL_WARMSTART | mujoco.mjtDisableBit.mjDSBL_ISLAND


def _add_segments(
    spec: mujoco.MjSpec, skeleton: Skeleton, damping: float, armature: float
) -> dict[str, mujoco.MjsBody]:
    root = spec.worldbody.add_body(name=ROOT)
    root.add_freejoint(name="root")
    bodies = {ROOT: root}
    for i, name in enumerate(skeleton.names[1:], start=1):
        parent = bodies[skeleton.names[skeleton.parents[i]]]
        body = parent.add_body(name=name, pos=skeleton.offsets_m[i], quat=skeleton.rest[i])
        cone = float(np.linalg.norm(np.abs(skeleton.limits_rad[i - 1]).max(axis=-1)))
        body.add_joint(
            name=name,
            type=mujoco.mjtJoint.mjJNT_BALL,
            range=[0.0, min(cone, math.radians(170))],
            damping=damping,
            armature=armature,
        )
        bodies[name] = body
    return bodies


def _add_primitive(body: mujoco.MjsBody, primitive: Primitive, friction: list[float]) -> None:
    common = {"name": primitive.name, "mass": primitive.mass_kg, "friction": friction}
    if primitive.kind == "capsule":
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=primitive.points_m.ravel(),
            size=[primitive.size_m[0], 0, 0],
            **common,
        )
    else:
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, pos=primitive.points_m[0], size=primitive.size_m, **common
        )


def _add_motors(spec: mujoco.MjSpec, skeleton: Skeleton, mass_kg: float) -> None:
    for joint, limits in zip(joints(), skeleton.limits_rad, strict=True):
        for axis, name in enumerate(AXES):
            gear = np.zeros(6)
            gear[axis] = 1.0
            motor = spec.add_actuator(
                name=f"{joint['name']}_{name}",
                trntype=mujoco.mjtTrn.mjTRN_JOINT,
                target=joint["name"],
                gear=gear,
                forcerange=np.array([-1.0, 1.0]) * joint["torque_Nmpkg"] * mass_kg,
                ctrlrange=limits[axis],
            )
            motor.set_to_position(
                kp=joint["stiffness_Nmpradkg"] * mass_kg, kv=joint["damping_Nmspradkg"] * mass_kg
            )
