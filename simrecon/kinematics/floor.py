"""The floor of a fit: how it is known, and where the person of a fit without one says that it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon.kinematics import forward, ground, upright
from simrecon.kinematics.layout import Variables
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.state import State
from simrecon.trust import Trust
from simrecon.types import Array, Evidence, IntArray, Primitive, Scene

FRAMES = 120  # spread over the clip, which are enough for a plane
TOLERANCE_M = 0.02  # of motion capture: nearer to zero, its floor is the scene's


def known(evidence: Evidence, scene: Scene, worth: Trust) -> str:
    """How the floor is known: one of `trust.FLOORS`.

    The world of motion capture is that of a scene with items, or with a floor that is not at zero.
    """
    if worth.floor == "level":
        ground = scene.ground
        return "scene" if scene.items or ground.height_m or ground.slope_rad else "level"
    seen = evidence.ground_known and evidence.camera is not None and evidence.camera.path is not None
    return "scene" if seen else worth.floor


def laid(scene: Scene, height_m: float) -> Scene:
    """The scene with its floor at a height, unless that is where it lies."""
    if abs(height_m) <= TOLERANCE_M:
        return scene
    return replace(scene, ground=replace(scene.ground, height_m=height_m))


def _spread(frames: int) -> IntArray:
    """Frames over the whole clip."""
    return np.unique(np.linspace(0, frames - 1, min(frames, FRAMES)).round().astype(np.int64))


def _skin(
    problem: Problem, variables: Variables, parts: tuple[Primitive, ...], rows: IntArray, *, toes: bool = True
) -> tuple[Array, Array, Array]:
    """Points on the surface of the left foot, the right foot and the whole body, in some frames."""
    state = State(problem, variables)
    pose = forward.at(state.pose, rows)
    return ground.skin(problem.skeleton, parts, pose, state.scale, variables.sole_m, toes=toes)


def height_m(problem: Problem, variables: Variables, parts: tuple[Primitive, ...]) -> float:
    """Height of a level floor in the world of the fit (`ground.level`)."""
    rows = _spread(problem.frames)
    skin = _skin(problem, variables, parts, rows, toes=False)
    return ground.level(*skin, problem.observations.standing[:, rows])


def transform(
    problem: Problem,
    variables: Variables,
    parts: tuple[Primitive, ...],
    *,
    world: bool,
    turned: Array | None = None,
) -> Array:
    """Transform (4, 4) that brings the ground under the person to the scene's (Gärtner 2022, eq. 7).

    The person is turned upright first (`upright`); where that is sure, the plane is level.

    Args:
        problem: without a floor.
        variables: its solution.
        parts: primitives of the unscaled body.
        world: whether the 3D estimate is in a world of its own, whose up is taken for about right.
        turned: a rotation (3, 3) before that (`tilt`), by which up is known: the plane is level.
    """
    up = upright.find(State(problem, variables), world=world)
    turn = np.eye(4)
    turn[:3, :3] = up.turn if turned is None else up.turn @ turned
    skin = [points @ turn[:3, :3].T for points in _skin(problem, variables, parts, _spread(problem.frames))]
    tilt = turned is None and not world and up.sigma_rad > upright.SURE_RAD
    move = ground.transform(*skin, tilt=tilt, scene=problem.scene) @ turn
    move[2, 3] += problem.scene.ground.height_m
    return move
