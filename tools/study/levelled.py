"""A planner for studies: the kinematic fit, with feet that stand put level on the floor, at rest."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from simrecon import kinematics
from simrecon.body.primitives import FEET
from simrecon.evaluation.configurations import Configurations, configurations
from simrecon.plan import Plan
from simrecon.scene import build
from simrecon.sim.models import compile_text
from simrecon.types import Array, Evidence, KinematicFit, Reference, runs

STILL_MPS, NEAR_M, SMOOTH_S = 0.2, 0.03, 0.05
"""A foot stands whose sole is slower and whose lowest corner is nearer to the floor."""
ITERATIONS, DAMPING = 8, 0.02
LEG = ("hip", "knee", "ankle")


def plan(fit: KinematicFit, _evidence: Evidence, _settings: Plan) -> Reference:
    """The fit with corners of standing soles on the floor, each stance in one place, by turns of the legs."""
    model = compile_text(build(fit.body.mjcf, fit.scene, 0.01))
    shown = configurations(model, fit.scene, fit.qpos, FEET, fit.body.skeleton.point_names)
    interval_s = float(fit.times_s[1] - fit.times_s[0])
    stands = standing(shown, interval_s)
    surely = gaussian_filter1d(stands.astype(float), SMOOTH_S / interval_s, axis=0)  # (T, 2)
    target = _places(shown.corners_m.reshape(-1, 2, 4, 3), stands)
    target[..., 2] += fit.scene.ground.height_m - target[..., 2]
    data, qpos = mujoco.MjData(model), fit.qpos.copy()
    dofs = np.concatenate([np.arange(3), *(_dofs(model, foot) for foot in FEET)])
    for frame in range(len(qpos)):
        data.qpos[:] = qpos[frame]
        for _ in range(ITERATIONS):
            step = _step(model, data, target[frame], surely[frame], dofs)
            mujoco.mj_integratePos(model, data.qpos, step, 1.0)
        qpos[frame] = data.qpos
    return Reference("levelled", fit.times_s, qpos, kinematics.configurations(fit.body, qpos)[0])


def standing(shown: Configurations, interval_s: float) -> NDArray[np.bool_]:
    """Which feet stand, (T, 2)."""
    middle = shown.corners_m.reshape(-1, 2, 4, 3).mean(axis=2)
    middle = gaussian_filter1d(middle, SMOOTH_S / interval_s, axis=0)
    speed = np.linalg.norm(np.gradient(middle, interval_s, axis=0), axis=-1)
    return np.asarray((speed < STILL_MPS) & (shown.feet_m < NEAR_M))


def _places(corners: Array, stands: NDArray[np.bool_]) -> Array:
    """Corners (T, 2, 4, 3) with the mean place of each stance in its frames."""
    places = corners.copy()
    for foot in range(2):
        for rows in runs(stands[:, foot]):
            places[rows, foot] = corners[rows, foot].mean(axis=0)
    return places


def _dofs(model: mujoco.MjModel, foot: str) -> Array:
    side = foot.split("_")[0]
    first = [model.body(f"{side}_{joint}").dofadr[0] for joint in LEG]
    return np.concatenate([np.arange(start, start + 3) for start in first])


def _step(model: mujoco.MjModel, data: mujoco.MjData, target: Array, surely: Array, dofs: Array) -> Array:
    """A damped Gauss-Newton step (nv,) of both soles' corners to their targets (2, 4, 3)."""
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    rows, errors = [], []
    for column, foot in enumerate(FEET):
        geom = model.geom(foot)
        half = geom.size * np.array([[1, 1, -1], [1, -1, -1], [-1, -1, -1], [-1, 1, -1]])
        corners = data.geom(foot).xpos + half @ data.geom(foot).xmat.reshape(3, 3).T  # (4, 3)
        for corner, place in zip(corners, target[column], strict=True):
            jacobian = np.zeros((3, model.nv))
            mujoco.mj_jac(model, data, jacobian, None, corner, int(geom.bodyid[0]))
            rows.append(surely[column] * jacobian[:, dofs])
            errors.append(surely[column] * (place - corner))
    matrix, error = np.concatenate(rows), np.concatenate(errors)
    step = np.zeros(model.nv)
    step[dofs] = np.linalg.solve(matrix.T @ matrix + DAMPING**2 * np.eye(len(dofs)), matrix.T @ error)
    return step
