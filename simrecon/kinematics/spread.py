"""How far the points of a fit may be off: draws from the Gaussian whose precision is the fit's own curvature.

Along the line of sight and across it errors are of another kind: a network is wrong in depth for seconds on
end, where landmarks in the image scatter from frame to frame. So both are kept apart, and whoever uses them
gives each a factor (`models/evidence/bands.toml`).
"""

from __future__ import annotations

import numpy as np

from simrecon.geometry import camera as cameras
from simrecon.kinematics import conditioning
from simrecon.kinematics.curvature import curvature
from simrecon.kinematics.layout import Variables
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.state import State
from simrecon.types import Array, Camera

DRAWS = 48
"""Standard deviations are off by a tenth."""
STEP = 0.1
"""Of the draws, in standard deviations, so that poses stay where the curvature was taken."""
SEED = 0


def spread(problem: Problem, variables: Variables, camera: Camera | None) -> Array:
    """Standard deviations (2, T, M, 3), m, of the points: across the line of sight, and along it.

    Args:
        problem: that was solved, in the world of the scene.
        variables: its solution; axes are those of the world.
        camera: in the same world; without a path all counts as across.
    """
    known = conditioning.condition(curvature(problem, variables))
    at = variables.pack()
    points = np.swapaxes(State(problem, variables).landmarks_m, 0, 1)  # (T, M, 3)
    line = sight(points, camera)
    squares = np.zeros((2, *points.shape))
    rng = np.random.default_rng(SEED)
    for _ in range(DRAWS):
        moved = at + STEP * known.to_variables(rng.standard_normal(len(at)))
        drawn = State(problem, Variables.unpack(moved, problem.frames, len(variables.lengths)))
        off = (np.swapaxes(drawn.landmarks_m, 0, 1) - points) / STEP
        along = (off * line).sum(axis=-1, keepdims=True) * line
        squares += np.square((off - along, along))
    return np.asarray(np.sqrt(squares / DRAWS))


def sight(points: Array, camera: Camera | None) -> Array:
    """Directions (T, 1, 3) from the camera to the middle of the points (T, M, 3); zero without a camera."""
    if camera is None or camera.path is None:
        return np.zeros((len(points), 1, 3))
    path = np.broadcast_to(cameras.extrinsics(camera), (len(points), 4, 4))
    centre = -np.einsum("tji,tj->ti", path[:, :3, :3], path[:, :3, 3])
    line = points.mean(axis=1) - centre
    return np.asarray((line / np.linalg.norm(line, axis=-1, keepdims=True))[:, None])
