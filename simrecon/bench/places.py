"""Boxes placed from the evidence, where the scene of a clip is not in its data."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np

from simrecon import kinematics
from simrecon import scene as scenes
from simrecon.errors import InputError
from simrecon.evidence import resample
from simrecon.metrics import bodies
from simrecon.plan import Kinematics
from simrecon.types import Array, Evidence, Scene, SceneItem

# Lengths of boxes along and across the direction that the person faces.
SEAT_M = (0.45, 1.0)
SEAT_FRONT_M, HEEL_ROOM_M = 0.12, 0.04
"""How far a seat reaches before the hips, and how far it stays from the heels."""
PLATFORM_BACK_M, PLATFORM_FRONT_M, PLATFORM_WIDTH_M = 0.15, 0.08, 0.8
_SEATED_M = 0.05
_EVALUATIONS = 60  # the hips are in their place long before the limbs
_BUTTOCKS = ("left_buttock", "right_buttock", "pelvis")


def seat(evidence: Evidence, plan: Kinematics) -> Scene:
    """A floor and a seat under the hips.

    The kinematic fit on a bare floor says where the buttocks are when they are lowest; the seat's top is the
    10th percentile of their height in these frames, and its front is 12 cm before the hips, or 4 cm behind
    the heels.

    Args:
        evidence: of a person who sits down.
        plan: of the kinematic fit.
    """
    rough = replace(plan, evaluations=min(plan.evaluations, _EVALUATIONS))
    fit = kinematics.fit(resample(evidence)[0], Scene(), rough)
    model = mujoco.MjModel.from_xml_string(scenes.build(fit.body.mjcf, fit.scene, 0.01))
    names = ("left_hip", "right_hip", "left_knee", "right_knee", "left_heel", "right_heel")
    shape = bodies.configurations(model, fit.scene, fit.qpos, _BUTTOCKS, names)
    lowest = shape.floor_m.min(-1)  # (T,)
    seated = lowest < np.percentile(lowest, 5) + _SEATED_M
    hips, knees, heels = (shape.points_m[seated, i : i + 2, :2].mean((0, 1)) for i in (0, 2, 4))  # (2,)
    ahead = _unit(knees - hips)
    room = float((heels - hips) @ ahead) - HEEL_ROOM_M
    front = min(SEAT_FRONT_M, room)
    height = float(np.percentile(lowest[seated], 10))
    if height <= 0.05:
        raise InputError(
            f"seat: found buttocks {height:.2f} m above the floor; valid: a person who sits on something"
        )
    middle = hips + (front - SEAT_M[0] / 2) * ahead
    return _box("seat", middle, ahead, (*SEAT_M, height), fit.scene)


def platform(evidence: Evidence, height_m: float) -> Scene:
    """A floor and a box of known height under the feet of the first frame.

    Args:
        evidence: with heels and toes in the world.
        height_m: of the box.
    """
    names = [f"{side}_{end}" for end in ("heel", "toe") for side in ("left", "right")]
    if evidence.joints_frame != "world" or any(name not in evidence.joint_names for name in names):
        raise InputError("platform: found no heels and toes in the world; valid: joints_m with them")
    columns = [evidence.joint_names.index(name) for name in names]
    seen = evidence.joints_m[np.isfinite(evidence.joints_m[:, columns]).all((1, 2))]
    if not len(seen):
        raise InputError("platform: found no frame with both heels and toes; valid: one or more")
    heels, toes = (seen[0, columns[i : i + 2], :2].mean(0) for i in (0, 2))
    ahead = _unit(toes - heels)
    length = float(np.linalg.norm(toes - heels)) + PLATFORM_BACK_M + PLATFORM_FRONT_M
    middle = toes + (PLATFORM_FRONT_M - length / 2) * ahead
    return _box("platform", middle, ahead, (length, PLATFORM_WIDTH_M, height_m), Scene())


def _box(name: str, middle: Array, ahead: Array, size: tuple[float, float, float], scene: Scene) -> Scene:
    base = (float(middle[0]), float(middle[1]), scene.ground.height_m)
    rounded = tuple(round(float(value), 3) for value in size)
    item = SceneItem(
        name=name,
        kind="box",
        position_m=(round(base[0], 3), round(base[1], 3), base[2]),
        size_m=(rounded[0], rounded[1], rounded[2]),
        yaw_rad=round(float(np.arctan2(ahead[1], ahead[0])), 4),
    )
    return Scene(scene.ground, (item,))


def _unit(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector))
