"""The Hessian of the kinematic objective in the approximation of Gauss and Newton, for `conditioning`.

Robust terms count with their weight at the point where it is taken. Terms that the search can do without are
left out or simplified: an exact Hessian is not needed. It is taken in blocks of frames, as all of it at once
would be gigabytes of a long clip.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from simrecon import scene as scenes
from simrecon.geometry import rotations
from simrecon.kinematics import contacts, forward, objective, terms
from simrecon.kinematics.objective import Objective, Observations
from simrecon.kinematics.variables import Variables
from simrecon.types import Array, IntArray, Skeleton

FREE = 54
"""Unknowns of a frame: the root's place, and 17 rotation vectors."""
REACH = 2
"""Frames on either side that a frame is tied to."""
LEAST_PRIOR = 2e-4  # twists that nothing sees must have some unit where a plan has no prior
GRAVITY_MPS2 = 9.81


BLOCK = 64
"""Frames of which the curvature is taken at once."""
LEAN = 3
"""Directions in which the 3D estimate of a frame leans."""


@dataclass(frozen=True, eq=False)
class Curvature:
    """Blocks of the Hessian: the n columns of consecutive frames, and their share of the corner.

    Attributes:
        blocks: of frame t + k with frame t, (n, 54, 54), for k = 0, 1, 2; fewer where the clip ends.
        border: (n, 54, 2 + L + 3) of a frame with scale, sole, lengths, and the lean of the frame.
        leans: (n, F) the lean of a frame by its coefficients.
        corner: (m, m) of the m = 2 + L + 3 F shared unknowns.
    """

    blocks: tuple[Array, Array, Array]
    border: Array
    leans: Array
    corner: Array

    def wide(self) -> Array:
        """The border by all shared unknowns, (n, 54, m)."""
        return _widened(self.border, self.leans)


def curvature(problem: Objective, variables: Variables) -> Iterator[Curvature]:
    """Curvature of the objective at the variables, one block of frames after the other."""
    frames = len(problem.base)
    for start in range(0, frames, BLOCK):
        stop = min(start + BLOCK, frames)
        near = slice(max(start - REACH, 0), stop + REACH)
        found = _block(problem.part(near), variables.part(near), slice(start - near.start, stop - near.start))
        if start == 0:
            found.corner[:] += _priors(problem)
        yield found


def _block(problem: Objective, variables: Variables, own: slice) -> Curvature:
    """Curvature of the `own` frames of a problem of these and their neighbours."""
    see, w, dt = problem.observations, problem.weights, problem.observations.interval_s
    pose, scale = problem.pose(variables), float(np.exp(variables.log_scale))
    skeleton, touch = problem.skeleton, problem.contacts
    offsets = scale * skeleton.point_offsets_m + variables.sole_m * problem.drop
    marks = forward.points(pose, skeleton.point_segments, offsets)
    moves = jacobian(skeleton, pose, skeleton.point_segments, marks)  # (T, M, 3, 54)
    wide = np.concatenate((moves, _shared(problem, variables, pose, scale, marks)), axis=-1)

    frames, plain = len(problem.base), wide.shape[-1]
    full = np.zeros((frames, plain + LEAN, plain + LEAN))
    if see.world_to_camera is not None and w.keypoint:
        full[:, :plain, :plain] += gram(wide, w.keypoint * dt * _image(see, see.world_to_camera, marks))
    _estimate(problem, variables, scale, marks, wide, full)
    blocks = [full[:, :FREE, :FREE], *(np.zeros((frames - k, FREE, FREE)) for k in (1, 2))]

    chain = _second_differences(frames, 2 * w.smooth_position / (dt**3 * objective.SIGMA_SMOOTH_MPS2**2))
    _tie(blocks, moves, chain)
    if w.travel_position:
        _tie(blocks, moves, _travelled(marks, w.travel_position, dt))
    feet = moves[:, problem.feet]
    _tie(blocks, feet, _held(marks[problem.feet], w.still, dt))
    offsets = scale * touch.offsets_m + variables.sole_m * touch.drop
    spheres = forward.points(pose, touch.segments, offsets)
    reach = jacobian(skeleton, pose, touch.segments, spheres)  # (T, G, 3, 54)
    mass = np.einsum("g,tgij->tij", touch.mass_share, reach)[:, None]  # (T, 1, 3, 54)
    for axes, chain in _mass_chains(problem, spheres):
        _tie(blocks, mass[:, :, axes], chain)
    weights = _contact(problem, spheres, scale)
    touching = weights.any(axis=(0, 2, 3))
    blocks[0] += gram(reach[:, touching], weights[:, touching])
    _joints(problem, variables, blocks)

    border, leans = full[own, :FREE, FREE:], problem.leans[own]
    rows = np.swapaxes(_widened(full[own, FREE:, FREE:], leans), 1, 2)  # (T, m, 2 + L + 3)
    corner = _widened(rows, leans).sum(axis=0)
    return Curvature((blocks[0][own], blocks[1][own], blocks[2][own]), border, leans, corner)


def _widened(columns: Array, leans: Array) -> Array:
    """Columns (T, n, 2 + L + 3) of which the last, of a frame's lean, become those of its coefficients."""
    lean = np.einsum("tni,tf->tnfi", columns[..., -LEAN:], leans).reshape(*columns.shape[:2], -1)
    return np.concatenate((columns[..., :-LEAN], lean), axis=-1)


def jacobian(skeleton: Skeleton, pose: forward.Pose, segments: IntArray, points_m: Array) -> Array:
    """Derivative of points (P, T, 3) by the unknowns of their frame, (T, P, 3, 54)."""
    count, frames = pose.origins_m.shape[:2]
    moved = np.zeros((frames, len(segments), 3, FREE))
    moved[..., :3] = np.eye(3)
    turning = pose.before @ pose.jacobians  # (17, T, 3, 3) columns are axes in the world
    below = _below(skeleton)
    for b in range(count):
        rows = np.flatnonzero(below[b, segments])
        lever = points_m[rows] - pose.origins_m[b]  # (P', T, 3)
        for c in range(3):
            turn = forward.cross(turning[b, :, :, c][None], lever)
            moved[:, rows, :, 3 + 3 * b + c] = turn  # indices apart: the rows come first
    return moved


def _below(skeleton: Skeleton) -> Array:
    """Which segments a joint moves, (17, 17)."""
    count = len(skeleton.names)
    below = np.zeros((count, count), bool)
    for segment in range(count):
        joint = segment
        while joint >= 0:
            below[joint, segment] = True
            joint = int(skeleton.parents[joint])
    return below


def _shared(
    problem: Objective, variables: Variables, pose: forward.Pose, scale: float, marks: Array
) -> Array:
    """Derivative of the landmarks by log scale, sole and lengths, (T, M, 3, 2 + L)."""
    skeleton = problem.skeleton
    segments = skeleton.point_segments
    down = (pose.axes[segments] @ problem.drop[:, None, :, None])[..., 0]  # (M, T, 3)
    grown = marks - variables.root_m - variables.sole_m * down
    longer = scale * np.exp(variables.lengths)[:, None, None] * problem.stretch[:, 1:]  # (L, 16, 3)
    shift = np.einsum("btij,lbj->lbti", pose.axes[skeleton.parents[1:]], longer)  # (L, 16, T, 3)
    lengths = np.einsum("bm,lbti->lmti", _below(skeleton)[1:, segments].astype(float), shift)
    return np.moveaxis(np.concatenate((grown[None], down[None], lengths)), (0, 2), (3, 0))


def gram(moves: Array, weights: Array) -> Array:
    """Σ_p J_pᵀ w_p J_p of derivatives (T, P, 3, n) with weights (T, P, 3, 3), (T, n, n)."""
    frames, _, _, n = moves.shape
    weighted = weights @ moves
    return np.asarray(np.swapaxes(moves.reshape(frames, -1, n), 1, 2) @ weighted.reshape(frames, -1, n))


def _image(see: Observations, world_to_camera: Array, marks: Array) -> Array:
    """Curvature of the reprojection by the landmarks, (T, M, 3, 3)."""
    rotation, translation = world_to_camera[..., :3, :3], world_to_camera[..., :3, 3]
    xyz = (rotation @ marks[..., None])[..., 0] + translation  # (M, T, 3)
    depth = np.maximum(xyz[..., 2], 0.1)
    place = xyz[..., :2] / depth[..., None]
    slope = 1 / (1 + np.sum(((place - see.rays) / see.ray_sigma) ** 2, axis=-1))
    project = np.zeros((*depth.shape, 2, 3))
    project[..., 0, 0] = project[..., 1, 1] = 1 / depth
    project[..., 2] = -place / depth[..., None]
    project = project @ rotation
    weight = 2 * see.ray_weights * slope / see.ray_sigma**2
    return np.swapaxes(weight[..., None, None] * np.swapaxes(project, -1, -2) @ project, 0, 1)


def _estimate(
    problem: Objective, variables: Variables, scale: float, marks: Array, wide: Array, full: Array
) -> None:
    """Add what the 3D estimate says to `full`, (T, 54 + 2 + L + 3, …)."""
    see, w, dt = problem.observations, problem.weights, problem.observations.interval_s
    if not (see.joint_weights.any() and (w.joint or w.place)):
        return
    root = np.tensordot(see.root_weights, marks, axes=1)
    turn = problem.leans @ variables.lean
    targets = scale * forward.turned(turn, see.joints_m)
    slope = 1 / (1 + np.sum(((marks - root - targets) / w.joint_scale_m) ** 2, axis=-1))
    weight = 2 * w.joint * dt * see.joint_weights * slope / w.joint_scale_m**2  # (M, T)
    middle = np.einsum("m,tmij->tij", see.root_weights, wide)  # (T, 3, n)
    relative = wide - middle[:, None]
    relative[..., FREE] -= np.swapaxes(targets, 0, 1)
    # target turned by dρ moves by (J dρ) × q, so the residual by [q]ₓ J dρ
    lean = rotations.skew(np.swapaxes(targets, 0, 1)) @ rotations.left_jacobian(turn)[:, None]  # (T, M, 3, 3)
    full += gram(np.concatenate((relative, lean), axis=-1), weight.T[..., None, None] * np.eye(3))
    held = 2 * w.place * dt * see.place_weights / w.place_scale_m**2
    plain = wide.shape[-1]
    full[:, :plain, :plain] += held[:, None, None] * np.swapaxes(middle, -1, -2) @ middle


def _second_differences(frames: int, weight: float) -> list[Array]:
    """Bands of weight · D₂ᵀ D₂, from the main one on."""
    return _squared(np.full(max(frames - 2, 0), weight), (1.0, -2.0, 1.0), frames)


def _squared(weights: Array, row: tuple[float, ...] | Array, frames: int) -> list[Array]:
    """Bands of Rᵀ diag(w) R, where row i of R holds `row` (or its own (len(w), 3)) from column i on."""
    taps = np.broadcast_to(np.asarray(row), (len(weights), np.shape(row)[-1]))
    bands = [np.zeros(frames - k) for k in range(REACH + 1)]
    for i in range(taps.shape[1]):
        for j in range(i + 1):
            start = slice(j, j + len(weights))
            bands[i - j][start] += weights * taps[:, i] * taps[:, j]
    return bands


def _tie(blocks: list[Array], moves: Array, bands: list[Array]) -> None:
    """Add Σ_p c J_p(t+k)ᵀ J_p(t) with the bands c of k to the blocks; moves (T, P, i, 54)."""
    frames = len(moves)
    flat = moves.reshape(frames, -1, FREE)
    for k, band in enumerate(bands):
        if band.any():
            blocks[k] += band[:, None, None] * (np.swapaxes(flat[k:], 1, 2) @ flat[: frames - k])


def _travelled(values: Array, weight: float, dt: float) -> list[Array]:
    """Bands of `terms.travel` of values (M, T, C), with its speeds at this point."""
    return _squared(weight / (dt * terms.speeds(values, dt)), (-1.0, 1.0), values.shape[1])


def _held(feet: Array, weight: float, dt: float) -> list[Array]:
    """Bands of the term that holds slow feet, with the mean of their robust weights."""
    step = np.diff(feet, axis=1) / (dt * objective.SIGMA_STILL_MPS)
    slope = (1 / (1 + np.sum(step**2, axis=-1))).mean(axis=0)  # (T - 1,)
    unit = 2 * weight * dt / (dt * objective.SIGMA_STILL_MPS) ** 2
    return _squared(unit * slope, (-1.0, 1.0), feet.shape[1])


def _mass_chains(problem: Objective, spheres: Array) -> list[tuple[slice, list[Array]]]:
    """Axes of the centre of mass, and the bands of what holds it over time: smoothness and balance."""
    w, dt, touch = problem.weights, problem.observations.interval_s, problem.contacts
    frames = spheres.shape[1]
    chains = [
        (slice(i, i + 1), _second_differences(frames, 2 * w.smooth_com / (dt**3 * sigma**2)))
        for i, sigma in enumerate(objective.SIGMA_COM_MPS2)
    ]
    if not w.balance or frames < 3:
        return chains
    com = np.tensordot(touch.mass_share, spheres, axes=1) - [0.0, 0.0, problem.scene.ground.height_m]
    feet = spheres[touch.soles].mean(axis=1)
    far = np.linalg.norm(com[1:-1, :2] - feet[:, 1:-1, :2], axis=-1).min(axis=0)
    share = problem.observations.standing[:, 1:-1].max(axis=0)
    share = share / (1 + (far / objective.SIGMA_BALANCE_M) ** 2)
    lever = com[1:-1, 2] / (GRAVITY_MPS2 * dt**2)
    rows = np.stack((-lever, 1 + 2 * lever, -lever), axis=-1)
    unit = 2 * w.balance * dt / objective.SIGMA_BALANCE_M**2
    return [*chains, (slice(0, 2), _squared(unit * share, rows, frames))]


def _contact(problem: Objective, spheres: Array, scale: float) -> Array:
    """Curvature of contact and penetration by the spheres, (T, G, 3, 3)."""
    w, see, touch = problem.weights, problem.observations, problem.contacts
    apart, normals = scenes.nearby(problem.scene, spheres)  # (S, G, T), (S, G, T, 3)
    clearance = apart - scale * touch.radii_m[:, None]
    thing = np.argmin(clearance, axis=0)[None]  # (1, G, T)
    nearest = np.take_along_axis(clearance, thing, axis=0)[0]
    normal = np.take_along_axis(normals, thing[..., None], axis=0)[0]  # (G, T, 3)
    weight = np.where(nearest < 0, w.penetration / objective.SIGMA_PENETRATION_M**2, 0.0)

    for pull in contacts.pulls(touch, see.standing, see.sitting, clearance):
        far = (nearest[pull.at[1:]] + pull.depth_m) / pull.sigma
        weight[pull.at[1:]] += w.contact * pull.weights / (pull.sigma**2 * (1 + far**2) ** 2)
    outer = normal[..., :, None] * normal[..., None, :]
    return np.swapaxes(2 * see.interval_s * weight[..., None, None] * outer, 0, 1)


def _joints(problem: Objective, variables: Variables, blocks: list[Array]) -> None:
    """Add limits, prior and smoothness of the rotation vectors, which are diagonal in them."""
    see, w, dt = problem.observations, problem.weights, problem.observations.interval_s
    frames = len(problem.base)
    joints = np.swapaxes(variables.rotvecs[1:], 0, 1)  # (T, 16, 3)
    low, high = problem.skeleton.limits_rad[..., 0], problem.skeleton.limits_rad[..., 1]
    beyond = (joints < low) | (joints > high)
    own = 2 * w.limit * beyond / objective.SIGMA_LIMIT_RAD**2 + 2 * max(w.prior, LEAST_PRIOR) / see.spread**2
    rows = np.arange(FREE)
    blocks[0][:, rows[:6], rows[:6]] += 1e-3 * dt
    blocks[0][:, rows[6:], rows[6:]] += dt * own.reshape(frames, -1)
    chain = _second_differences(frames, 2 * w.smooth_rotation / (dt**3 * objective.SIGMA_SMOOTH_RADPS2**2))
    if w.travel_rotation:
        more = _travelled(variables.rotvecs[1:], w.travel_rotation, dt)
        chain = [band + extra for band, extra in zip(chain, more, strict=True)]
    for block, band in zip(blocks, chain, strict=True):
        block[:, rows[6:], rows[6:]] += band[:, None]


def _priors(problem: Objective) -> Array:
    """Curvature of the priors on what all frames share, (m, m)."""
    see, tall = problem.observations, np.concatenate(([1.0, 0.0], problem.tallness))
    count = len(tall) + 3 * problem.leans.shape[1]
    found = np.zeros((count, count))
    found[: len(tall), : len(tall)] = 2 * np.outer(tall, tall) / see.scale_sigma**2
    own = np.full(count, 2 / objective.SIGMA_LEAN_RAD**2)
    own[: len(tall)] = [
        0.0,
        2 / objective.SIGMA_SOLE_M**2,
        *np.full(len(problem.tallness), 2 / objective.SIGMA_LENGTH**2),
    ]
    return np.asarray(found + np.diag(own))
