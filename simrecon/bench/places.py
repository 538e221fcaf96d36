"""Boxes placed from the evidence, where the scene of a clip is not in its data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon import kinematics
from simrecon.errors import InputError
from simrecon.evidence import resample
from simrecon.plan import Kinematics
from simrecon.scene import suggest
from simrecon.types import Array, Evidence, Scene, SceneItem

PLATFORM_BACK_M, PLATFORM_FRONT_M, PLATFORM_WIDTH_M = 0.15, 0.08, 0.8
_EVALUATIONS = 100  # the hips are in their place long before the limbs


def seat(evidence: Evidence, plan: Kinematics) -> Scene:
    """A floor and what a kinematic fit needs to sit on (`scene.suggest`).

    Args:
        evidence: of a person who sits down.
        plan: of the kinematic fit, in which nothing holds the body to the floor.

    Raises:
        InputError: nobody sits.
    """
    room = support(evidence, plan)
    seats = tuple(item for item in room.items if item.name.startswith("seat"))
    if not seats:
        raise InputError("seat: found no person who sits on something; valid: evidence of a person who does")
    return replace(room, items=seats)


def support(evidence: Evidence, plan: Kinematics) -> Scene:
    """A floor and all that a kinematic fit needs to stand, sit or lie on (`scene.suggest`).

    Args:
        evidence: of a person.
        plan: as in `seat`.
    """
    rough = replace(kinematics.floating(plan), evaluations=min(plan.evaluations, _EVALUATIONS))
    fit = kinematics.fit_to_stature(resample(evidence)[0], Scene(), rough)
    suggestions = suggest.suggest(fit.body, fit.scene, fit.times_s, fit.qpos)
    return Scene(fit.scene.ground, tuple(entry.item for entry in suggestions))


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
    size = (round(length, 3), PLATFORM_WIDTH_M, height_m)
    item = SceneItem(
        name="platform",
        kind="box",
        position_m=(round(float(middle[0]), 3), round(float(middle[1]), 3), 0.0),
        parameters={"size_m": size},
        yaw_rad=round(float(np.arctan2(ahead[1], ahead[0])), 4),
    )
    return Scene(items=(item,))


def _unit(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector))
