"""Landmarks in space, of 3D lifters or several cameras: unit, up axis, mirror image and place by geometry.

A lifter puts the hips of every frame at the origin, or at the height that leaves the feet at zero. Such
landmarks have no place in the world; they are a shape around the hips, on the axes of the camera.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from simrecon.errors import InputError
from simrecon.evidence import axes
from simrecon.evidence.content import Content
from simrecon.evidence.keypoints import anatomy, layouts, pixels, tracks
from simrecon.evidence.options import Options
from simrecon.geometry import vectors
from simrecon.io.messages import counted
from simrecon.types import Array, Evidence, IntArray

# Hip to ankle, of stature (Winter 2009, fig. 4.1: thigh 0.245, shank 0.246).
LEG_SHARE = 0.491
# Of a shape whose unit is not known.
STATURE_M = 1.7
# Hips that stay within this share of stature of one point were put there.
FIXED_SHARE = 0.03
# Of the bends of knees and elbows that can be seen, by size, so much must be to the right side.
MIRROR_SHARE = 0.5
BEND_MIN = 0.02


def to_evidence(
    content: Content,
    frames: IntArray,
    joints: Array,
    names: Sequence[str] | layouts.Order,
    options: Options,
    notes: str = "",
    *,
    trust: str = "",
    stamps_s: Mapping[int, float] | None = None,
) -> Evidence:
    """Evidence of one person's landmarks in space.

    Args:
        content: the file.
        frames: (T,) their numbers.
        joints: (T, J, 3) in the file's unit and axes, NaN = unknown.
        names: of the J landmarks, `""` for those to leave out; or how they are ordered.
        options: of the user.
        notes: on how the file was read.
        trust: what landmarks with a place in the world are worth, for `simrecon.trust`.
        stamps_s: times of frames by number, where the file has them.

    Raises:
        InputError: no person in it, no unit or no up axis.
    """
    layout = ""
    if isinstance(names, layouts.Order) or options.layout is not None:
        order = names if isinstance(names, layouts.Order) else layouts.Order("keypoints", ())
        names, layout = anatomy.decide(content, order, joints, options.layout)
    keep = [i for i, name in enumerate(names) if name]
    kept = tuple(names[i] for i in keep)
    joints = np.where(np.isfinite(joints).all(axis=-1, keepdims=True), joints, np.nan)[:, keep]
    stature = _stature(content, joints, kept)
    hips = np.mean([joints[:, kept.index(f"{side}_hip")] for side in ("left", "right")], axis=0)  # (T, 3)
    up, how = axes.find_up(content.source, pixels.upright(joints, kept), options.up)
    level = joints @ axes.to_z_up(up).T
    mirrored = _is_mirrored(level, kept)
    if mirrored:
        joints = joints * [-1.0, 1.0, 1.0]
        level = joints @ axes.to_z_up(up).T
    fixed = _is_fixed(hips @ axes.to_z_up(up).T, stature)
    metre, unit = _unit(content, stature, options.unit, shape_only=fixed)
    if fixed:
        placed, frame = _on_camera_axes(level), "camera_root_relative"
        place = "hips at one point in all frames: a shape without a place (--keypoints FILE gives one)"
    elif up == "-y" and np.nanmedian(hips[:, 2]) > stature:
        placed, frame, place = joints, "camera", "before the camera, on its axes"
    else:
        placed, frame, place = level, "world", ""
    mirror = (
        "a mirror image, by how knees and elbows bend: left and right of space exchanged" if mirrored else ""
    )
    parts = (
        f"{counted(len(keep), 'landmark')} in space of {len(names)}",
        layout, notes, unit, f"up axis {up} ({how})",
        mirror, place, tracks.numbering(frames),
    )  # fmt: skip
    return Evidence(
        times_s=tracks.frame_times(content, frames, options, stamps_s),
        keypoint_names=(),
        keypoints_px=np.empty((len(frames), 0, 2)),
        scores=np.empty((len(frames), 0)),
        joint_names=kept,
        joints_m=placed * metre,
        joints_frame=frame,
        camera=options.camera if frame != "world" else None,
        trust=trust if frame == "world" else "",
        sha256=content.sha256,
        reading="; ".join(part for part in parts if part),
    )


def _stature(content: Content, joints: Array, names: Sequence[str]) -> float:
    """Of the person, in the file's unit, by the legs."""
    at = {name: i for i, name in enumerate(names)}
    needed = [
        f"{side}_{point}" for side in ("left", "right") for point in ("hip", "knee", "ankle", "shoulder")
    ]
    if missing := [name for name in needed if name not in at]:
        raise content.fail(
            "keypoints", f"no {', '.join(missing)}", "landmarks of shoulders, hips, knees and ankles"
        )
    legs = [
        np.linalg.norm(joints[:, at[f"{side}_hip"]] - joints[:, at[f"{side}_knee"]], axis=-1)
        + np.linalg.norm(joints[:, at[f"{side}_knee"]] - joints[:, at[f"{side}_ankle"]], axis=-1)
        for side in ("left", "right")
    ]
    if not np.isfinite(legs).any():
        raise content.fail("keypoints", "no frame with a whole leg", "landmarks of hips, knees and ankles")
    return float(np.nanmedian(legs)) / LEG_SHARE


def _unit(
    content: Content, stature: float, choice: str | float | None, *, shape_only: bool
) -> tuple[float, str]:
    """Metres in the file's unit, and how that was found."""
    try:
        unit, how = axes.find_unit(content.source, stature, choice)
    except InputError:
        if not shape_only or stature <= 0:
            raise
        return STATURE_M / stature, f"unit unknown, taken for a person of {STATURE_M:g} m"
    return axes.metres(unit), f"unit {unit} ({how})"


def _is_fixed(hips: Array, stature: float) -> bool:
    """Whether the hips (T, 3), z up, were put at one place of the ground in every frame."""
    known = hips[np.isfinite(hips).all(axis=-1), :2]
    off = np.linalg.norm(known - np.median(known, axis=0), axis=-1) if len(known) else np.zeros(1)
    central = np.linalg.norm(np.median(known, axis=0)) if len(known) else 0.0
    return bool(np.quantile(off, 0.95) <= FIXED_SHARE * stature and central <= FIXED_SHARE * stature)


def _is_mirrored(joints: Array, names: Sequence[str]) -> bool:
    """Whether knees bend forwards and elbows backwards in joints (T, J, 3), z up.

    Forwards is left × up. What counts is where the middle joint lies from the line between its neighbours:
    the knee before it, the elbow behind it.
    """
    at = {name: i for i, name in enumerate(names)}
    total = bent = 0.0
    for chain, sign in ((("hip", "knee", "ankle"), 1.0), (("shoulder", "elbow", "wrist"), -1.0)):
        ends = [at.get(f"{side}_{chain[0]}") for side in ("left", "right")]
        if None in ends:
            continue
        left = joints[:, ends[0]] - joints[:, ends[1]]
        trunk = pixels.upright(joints, names)
        forward = vectors.unit(np.cross(left, trunk))  # (T, 3)
        for side in ("left", "right"):
            row = [at.get(f"{side}_{point}") for point in chain]
            if None in row:
                continue
            first, middle, last = (joints[:, i] for i in row)
            line = vectors.unit(last - first)
            off = middle - first
            off = off - np.sum(off * line, axis=-1, keepdims=True) * line
            reach = np.linalg.norm(last - first, axis=-1)
            ahead = sign * np.sum(off * forward, axis=-1) / np.maximum(reach, 1e-12)
            ahead = ahead[np.isfinite(ahead) & (np.abs(ahead) > BEND_MIN)]
            total += float(np.abs(ahead).sum())
            bent += float(ahead.sum())
    return bool(total > 0 and bent / total < -(1 - MIRROR_SHARE))


def _on_camera_axes(level: Array) -> Array:
    """From a level world, seen along y with x to the right, to a camera's axes: x right, y down, z ahead."""
    return np.stack((level[..., 0], -level[..., 2], level[..., 1]), axis=-1)
