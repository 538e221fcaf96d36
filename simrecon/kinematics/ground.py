"""The ground plane under a clip's bodies, Gärtner 2022, section 3.4, eqs. 6 and 7.

    L(T) = L_k(left foot) + L_k(right foot) + 2 L_k(whole body),   L_k(M) = Σ_t ‖min(δ, d_k(M_t))‖₂

with d_k the k smallest signed distances of a frame's points to the plane, or to an item of the scene that is
nearer. Where nothing is within δ of them, as in a jump, a frame says nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simrecon import scene as scenes
from simrecon.body import surface
from simrecon.body.primitives import FEET
from simrecon.geometry import rotations
from simrecon.kinematics import forward
from simrecon.optim import lbfgs
from simrecon.types import Array, Primitive, Scene, Skeleton

NEAREST, CLIP_M = 20, 0.2
"""k and δ (Gärtner 2022, section 3.4)."""
LOW = 2 * NEAREST
"""Points of a frame that are looked at among items, twice: distances from items take time."""
SIGMA_TILT_RAD = 0.15
"""Cameras are held about level: weighs as much as a frame at one deviation, so that it decides ties only."""
UNIT_RAD, UNIT_M = 0.05, 0.05
LOWEST_SHARE, STANCE_SHARE, FEWEST_STANCES = 0.05, 0.25, 5
LEVEL_M, LEVEL_SHARE = 0.03, 0.05
"""Stances within that of each other are on one level, and that share of all stances makes it a floor."""
UP = np.array([0.0, 0.0, 1.0])
NOTHING = Scene()


@dataclass(frozen=True, eq=False)
class Around:
    """What stands on a plane.

    Attributes:
        scene: with its ground where the plane is to be.
        centre_m: (3,) from which the points of the bodies count.
    """

    scene: Scene
    centre_m: Array


def loss(
    bodies_m: Sequence[tuple[float, Array]], plane: Array, around: Around | None = None
) -> tuple[float, Array]:
    """Eq. 7 and its gradient.

    Args:
        bodies_m: weight and points (T, P, 3) of the feet and of the whole body.
        plane: (3,) rotation about x and y (rad) that brings the plane's normal to z, and its height then (m).
        around: what stands on the plane; None: nothing.

    Returns:
        The loss, m, and its gradient (3,).
    """
    rotvec = np.array([plane[0], plane[1], 0.0])
    turn, jacobian = rotations.matrix(rotations.exp(rotvec)), rotations.left_jacobian(rotvec)
    total, gradient = 0.0, np.zeros(3)
    for weight, points in bodies_m:
        moved = points @ turn.T  # (T, P, 3)
        height, up = _clearance(moved, float(plane[2]), around)  # (T, P), (T, P, 3)
        count = min(NEAREST, height.shape[1])
        rows = np.argpartition(height, count - 1, axis=1)[:, :count]
        near = np.minimum(np.take_along_axis(height, rows, axis=1), CLIP_M)  # (T, k)
        norm = np.linalg.norm(near, axis=1)  # (T,)
        slope = np.where(near < CLIP_M, near / np.maximum(norm, 1e-9)[:, None], 0.0)
        places = np.take_along_axis(moved, rows[..., None], axis=1)  # (T, k, 3)
        normals = np.take_along_axis(up, rows[..., None], axis=1)
        # turned further by ω a point's clearance grows by n · (ω × p)
        about = forward.cross(places, normals)
        total += weight * float(norm.sum())
        turning = weight * np.sum(slope[..., None] * about, axis=(0, 1)) @ jacobian
        gradient += [turning[0], turning[1], -weight * float((slope * normals[..., 2]).sum())]
    tilt = plane[:2] / SIGMA_TILT_RAD
    unit = CLIP_M * np.sqrt(NEAREST)
    return total + unit * float(tilt @ tilt), gradient + unit * 2 * np.append(tilt, 0.0) / SIGMA_TILT_RAD


def _clearance(moved_m: Array, height_m: float, around: Around | None) -> tuple[Array, Array]:
    """Distance (T, P) of turned points (T, P, 3) from what is nearest to them, and its gradient."""
    if around is None:
        return moved_m[..., 2] - height_m, np.broadcast_to(UP, moved_m.shape)
    shift = around.centre_m + (around.scene.ground.height_m - height_m) * UP
    apart, normals = scenes.distances(around.scene, moved_m + shift)  # (S, T, P), (S, T, P, 3)
    nearest = np.argmin(apart, axis=0)[None]
    return (
        np.take_along_axis(apart, nearest, axis=0)[0],
        np.take_along_axis(normals, nearest[..., None], axis=0)[0],
    )


def transform(left_m: Array, right_m: Array, body_m: Array, *, tilt: bool, scene: Scene = NOTHING) -> Array:
    """The rigid transform (4, 4) that brings the ground plane to z = 0.

    The search begins at several heights and takes the best end. Items of the scene stand on the plane, where
    they stand on its ground; who is on one has the plane below it.

    Args:
        left_m: (T, P, 3) points of the left foot.
        right_m: of the right one.
        body_m: of the whole body.
        tilt: whether the slope is unknown too.
        scene: whose items count as supports.
    """
    parts = tuple(
        (weight, _low(points, scene)) for weight, points in ((1.0, left_m), (1.0, right_m), (2.0, body_m))
    )
    unit = np.array([UNIT_RAD, UNIT_RAD, UNIT_M])
    free = np.array([1.0, 1.0, 1.0] if tilt else [0.0, 0.0, 1.0])
    centre = body_m.reshape(-1, 3).mean(axis=0) * [1.0, 1.0, 0.0]
    turned = tuple((weight, points - centre) for weight, points in parts)  # a turn then leaves the height
    around = Around(scene, centre) if scene.items else None

    def scaled(x: Array) -> tuple[float, Array]:
        value, gradient = loss(turned, x * unit * free, around)
        return value, gradient * unit * free

    starts = [np.array([0.0, 0.0, h]) / unit for h in _heights(body_m, scene)]
    best = min(
        (lbfgs.minimize(scaled, start, max_evaluations=100, ftol_rel=1e-7) for start in starts),
        key=lambda end: end.loss,
    )
    plane = best.x * unit * free
    move = np.eye(4)
    move[:3, :3] = rotations.matrix(rotations.exp(np.array([plane[0], plane[1], 0.0])))
    move[:3, 3] = centre - move[:3, :3] @ centre - plane[2] * UP
    return move


def _low(points_m: Array, scene: Scene) -> Array:
    """Among items, the points (T, P, 3) of each frame that are lowest, and lowest over what is under them."""
    if not scene.items or points_m.shape[1] <= 2 * LOW:
        return points_m
    over = points_m[..., 2] - scenes.support_height(scene, points_m[..., :2])  # (T, P)
    ranks = [height.argsort(axis=1).argsort(axis=1) for height in (points_m[..., 2], over)]
    rows = np.argpartition(np.minimum(*ranks), 2 * LOW - 1, axis=1)[:, : 2 * LOW]
    return np.take_along_axis(points_m, rows[..., None], axis=1)


def _heights(body_m: Array, scene: Scene) -> Array:
    """Heights of the plane at which a search begins: under the body, and under what it may stand on."""
    lowest = body_m[..., 2].min(axis=1)
    heights = np.quantile(lowest, (0.02, 0.1, 0.3, 0.5))
    if not scene.items:
        return np.asarray(heights)
    tops = scenes.support_height(scene, body_m[..., :2].mean(axis=1)) - scene.ground.height_m  # (T,)
    return np.concatenate((heights, np.quantile(lowest - tops, (0.1, 0.5))))


def level(left_m: Array, right_m: Array, body_m: Array, standing: Array) -> float:
    """Height of a level floor under a body whose heights are right, m.

    It is the lowest level on which the feet stand: elsewhere they stand on things, and nobody stands in the
    floor. Where no foot ever stands the floor is where the body is lowest, but for errors.

    Args:
        left_m: (T, P, 3) points of the left foot.
        right_m: of the right one.
        body_m: of the whole body.
        standing: (2, T) how surely the left and the right foot stand still, 0 to 1.
    """
    soles = np.stack([points[..., 2].min(axis=1) for points in (left_m, right_m)])  # (2, T)
    stances = np.sort(soles[standing > 0.5])
    if len(stances) < FEWEST_STANCES:
        return float(np.quantile(body_m[..., 2].min(axis=1), LOWEST_SHARE))
    ends = np.searchsorted(stances, stances + LEVEL_M, side="right")
    first = int(np.argmax(ends - np.arange(len(stances)) >= max(FEWEST_STANCES, LEVEL_SHARE * len(stances))))
    return float(np.quantile(stances[first : ends[first]], STANCE_SHARE))


def skin(
    skeleton: Skeleton,
    primitives: Sequence[Primitive],
    pose: forward.Pose,
    scale: float,
    sole_m: float,
    *,
    toes: bool = True,
) -> tuple[Array, Array, Array]:
    """Points on the surface of the posed primitives: left foot, right foot, whole body; (T, P, 3) each.

    Args:
        skeleton: unscaled.
        primitives: of the unscaled body, soles at their usual height.
        pose: of its segments, scaled.
        scale: factor on all lengths.
        sole_m: how far the feet are lower than that.
        toes: whether feet reach beyond their balls. Who stands on the ball of a foot bends the toes, which
            this body cannot.
    """
    parts = []
    for part in primitives:
        values = np.zeros(9)
        values[: part.points_m.size] = part.points_m.ravel()
        values[6 : 6 + len(part.size_m)] = part.size_m
        points = scale * surface.samples(part.kind, values)[0]
        if part.name in FEET:
            points = points - sole_m * UP
            if not toes:
                ball = skeleton.point_names.index(part.name.replace("_foot", "_mtp"))
                points[:, 0] = np.minimum(points[:, 0], scale * skeleton.point_offsets_m[ball, 0])
        segments = np.full(len(points), skeleton.names.index(part.segment))
        parts.append(np.swapaxes(forward.points(pose, segments, points), 0, 1))
    names = [part.name for part in primitives]
    left, right = (parts[names.index(foot)] for foot in FEET)
    return left, right, np.concatenate(parts, axis=1)
