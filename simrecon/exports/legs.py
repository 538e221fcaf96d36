"""The motion on longer or shorter legs, with the feet where they were: nothing slides that stood.

In closed form, frame by frame: ankles keep place and orientation; the height of the hips over what the feet
stand on scales with the legs; two bones then reach from hip to ankle, with the knee on the side where it was.
Where legs are too short for that, the body sinks, smoothly. `simrecon retarget` solves more (other shapes,
and what hands touch) in seconds; this takes milliseconds, for files of rigs whose legs have another length.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import ndimage

from simrecon.body import mjcf
from simrecon.exports import segments
from simrecon.exports.segments import Segments
from simrecon.geometry import rotations, vectors
from simrecon.types import Array, Body, Flags, Scene, Skeleton

SIDES = ("left", "right")
STRETCH = 0.99995
"""A leg is never straighter than by this share of its length."""
SMOOTH_S = 0.25
"""Over which the body sinks and comes up again."""
FORWARD = 0.0005
"""Of the thigh's own forward axis, m, in the side to which a straight knee bends."""


def feet(skeleton: Skeleton, touching: Flags) -> Flags:
    """Which feet (G, 2), left and right, touch, of the segments (G, S) that do."""
    return touching[:, [skeleton.names.index(f"{side}_ankle") for side in SIDES]]


def on_other_legs(
    body: Body, qpos: Array, factor: float, loaded: Flags, scene: Scene, interval_s: float
) -> tuple[Body, Array]:
    """The body with other legs, and its configurations.

    Args:
        body: whose motion it is.
        qpos: (G, nq).
        factor: on the lengths of thigh and shank.
        loaded: (G, 2) feet that stand.
        scene: whose ground feet come from that never stand.
        interval_s: between frames.
    """
    skeleton = body.skeleton
    posed = segments.of(skeleton, qpos)
    other_body = with_legs(body, factor)
    other = other_body.skeleton
    rows = [skeleton.names.index(f"{side}_{joint}") for joint in ("knee", "ankle") for side in SIDES]
    ankles = posed.origins_m[:, rows[2:]]  # (G, 2, 3)
    reach_m = float(np.linalg.norm(other.offsets_m[rows], axis=1).sum()) / 2
    hips = posed.origins_m[:, [skeleton.names.index(f"{side}_hip") for side in SIDES]]
    base_m = standing_height_m(ankles, loaded, scene.ground.height_m, interval_s)
    over_m = np.maximum(hips[..., 2].mean(axis=1) - base_m, 0.0)
    up = np.zeros_like(qpos[:, :3])
    up[:, 2] = (factor - 1.0) * over_m
    up[:, 2] -= sinking_m(hips + up[:, None], ankles, loaded, reach_m, interval_s)
    quats = posed.quats.copy()
    for side in SIDES:
        _bend(other, side, posed, quats, up)
    return other_body, segments.configurations(other, qpos[:, :3] + up, quats)


def with_legs(body: Body, factor: float) -> Body:
    """The body with thighs and shanks of other lengths, of the same masses and radii."""
    skeleton, long = body.skeleton, np.array([1.0, 1.0, factor])
    offsets, points = skeleton.offsets_m.copy(), skeleton.point_offsets_m.copy()
    legs = [f"{side}_{joint}" for joint in ("hip", "knee") for side in SIDES]
    ends = [skeleton.names.index(name.replace("knee", "ankle").replace("hip", "knee")) for name in legs]
    offsets[ends] *= factor
    inside = np.isin(skeleton.point_segments, [skeleton.names.index(name) for name in legs])
    points[inside] *= long
    parts = tuple(
        replace(part, points_m=part.points_m * long) if part.segment in legs else part
        for part in body.primitives
    )
    skeleton = replace(skeleton, offsets_m=offsets, point_offsets_m=points)
    longer_m = (factor - 1.0) * float(np.linalg.norm(body.skeleton.offsets_m[ends], axis=1).sum()) / 2
    text = mjcf.make(skeleton, parts, body.mass_kg)
    return replace(body, skeleton=skeleton, primitives=parts, height_m=body.height_m + longer_m, mjcf=text)


def standing_height_m(ankles: Array, loaded: Flags, floor_m: float, interval_s: float) -> Array:
    """Height (G,) of the ankles of the feet that stand, smooth, and in between on the way to the next.

    Args:
        ankles: (G, 2, 3).
        loaded: (G, 2) feet that stand.
        floor_m: where no foot ever stands.
        interval_s: between frames.
    """
    any_foot = loaded.any(axis=1)
    if not any_foot.any():
        return np.full(len(ankles), floor_m)
    share = loaded / np.maximum(loaded.sum(axis=1, keepdims=True), 1)
    height = (share * ankles[..., 2]).sum(axis=1)
    frames = np.arange(len(ankles))
    filled = np.interp(frames, frames[any_foot], height[any_foot])
    return np.asarray(ndimage.gaussian_filter1d(filled, SMOOTH_S / (2 * interval_s), mode="nearest"))


def sinking_m(hips: Array, ankles: Array, loaded: Flags, reach_m: float, interval_s: float) -> Array:
    """By how much (G,) the body must be lower so that the legs reach the feet that stand.

    Args:
        hips: (G, 2, 3).
        ankles: (G, 2, 3) where they are to be.
        loaded: (G, 2) feet that stand.
        reach_m: of a leg.
        interval_s: between frames.
    """
    aside = np.linalg.norm((hips - ankles)[..., :2], axis=-1)
    high = np.sqrt(np.maximum((STRETCH * reach_m) ** 2 - aside**2, 0.0))
    excess = np.where(loaded, np.maximum((hips - ankles)[..., 2] - high, 0.0), 0.0).max(axis=1)
    if not excess.any():
        return np.asarray(excess)
    half = max(1, round(SMOOTH_S / interval_s))
    wide = ndimage.maximum_filter1d(excess, 4 * half + 1, mode="nearest")
    for _ in range(2):  # means of what is at least as much all around
        wide = ndimage.uniform_filter1d(wide, 2 * half + 1, mode="nearest")
    return np.asarray(wide)


def knees(hips: Array, before: Array, ankles: Array, bones_m: Array, forward: Array) -> Array:
    """Knees (G, 3) of legs of two bones.

    Args:
        hips: (G, 3).
        before: (G, 3) knees seen from the hips, in the motion before.
        ankles: (G, 3).
        bones_m: lengths of thigh and shank.
        forward: (G, 3) to which side a straight leg bends.
    """
    leg, (thigh_m, shank_m) = ankles - hips, bones_m
    longest = STRETCH * (thigh_m + shank_m)
    along = vectors.unit(leg)
    far = np.clip(np.linalg.norm(leg, axis=-1), abs(thigh_m - shank_m) * 1.001 + 1e-6, longest)
    side = before + FORWARD * forward
    side = vectors.unit(side - (side * along).sum(axis=-1, keepdims=True) * along)
    down = (thigh_m**2 - shank_m**2 + far**2) / (2 * far)
    out = np.sqrt(np.maximum(thigh_m**2 - down**2, 0.0))
    return np.asarray(hips + down[:, None] * along + out[:, None] * side)


def turned_to(quats: Array, bone: Array, to: Array) -> Array:
    """Orientations (G, 4) turned the least way in which a bone (3,) of theirs points along `to` (G, 3)."""
    now, then = vectors.unit(rotations.rotate(quats, bone)), vectors.unit(to)
    cross, dot = np.cross(now, then), (now * then).sum(axis=-1, keepdims=True)
    turn = rotations.canonical(np.concatenate((np.maximum(1.0 + dot, 1e-9), cross), axis=-1))
    return rotations.multiply(turn, quats)


def _bend(skeleton: Skeleton, side: str, before: Segments, quats: Array, up: Array) -> None:
    """Turn thigh and shank of a side in `quats` (G, S, 4), so that the ankle is where it was."""
    hip, knee, ankle = (skeleton.names.index(f"{side}_{joint}") for joint in ("hip", "knee", "ankle"))
    thigh, shank = skeleton.offsets_m[knee], skeleton.offsets_m[ankle]
    hips = before.origins_m[:, hip] + up
    forward = rotations.rotate(before.quats[:, hip], [1.0, 0.0, 0.0])
    bent = before.origins_m[:, knee] - before.origins_m[:, hip]
    ankles = before.origins_m[:, ankle]
    at = knees(hips, bent, ankles, np.linalg.norm((thigh, shank), axis=1), forward)
    quats[:, hip] = turned_to(before.quats[:, hip], thigh, at - hips)
    quats[:, knee] = turned_to(before.quats[:, knee], shank, ankles - at)
