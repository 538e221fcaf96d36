"""Evidence of the labelled points of TRC and C3D: markers on the skin, or the joints of a pose network."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simrecon.evidence.axes import find_up, to_z_up
from simrecon.evidence.content import Content
from simrecon.evidence.mocap import centres, feet, functional, labels, planar, pointset, size
from simrecon.evidence.mocap.pointset import NEEDED, PointSet
from simrecon.evidence.options import Options
from simrecon.evidence.values import bounded
from simrecon.io.messages import counted
from simrecon.types import Array, Evidence

PLANAR_TRUST = "mocap,joints_m=0.03,place_m=0.03,assume=0.1"
"""Some centimetres, as networks see the points of the plane; nothing is known across it."""

POINTS_MAX, LABEL_MAX = 2000, 100
"""No marker set has more points, and no point a longer label."""


def to_evidence(
    content: Content,
    options: Options,
    names: Sequence[str],
    places: Array,
    times: Array,
    unit: str | None,
    notes: Sequence[str] = (),
) -> Evidence:
    """Evidence of labelled points.

    Args:
        content: the file.
        options: of the user.
        names: labels of the M points.
        places: (T, M, 3) in the file's unit and axes; NaN = not seen.
        times: (T,) s.
        unit: that the file states, or None.
        notes: on how the file was read.

    Raises:
        InputError: points of too few joints, of several people, or in no unit that makes a person.
    """
    if len(names) > POINTS_MAX or max(map(len, names), default=0) > LABEL_MAX:
        there = f"{len(names)} labels of up to {max(map(len, names))} characters"
        raise content.fail("labels", there, f"at most {POINTS_MAX}, of {LABEL_MAX} characters")
    bounded(content, "points", places)
    points = pointset.of(content, options, names, places)
    near = points.near_joints()
    if absent := [name for name in NEEDED if name not in near]:
        raise pointset.missing(content, points, absent[0])
    metre = size.unit(content, near, options.unit, unit)
    axis, axis_how = find_up(content.source, size.upright(near), options.up)
    points = points.at(metre.metre * points.places @ to_z_up(axis).T)
    flat = planar.depth_axis(points.near_joints())
    centre, estimates, more = joints(content, points, flat)
    reading = [
        f"{counted(len(centre), 'joint')}, unit {metre.name} ({metre.how}), up {axis} ({axis_how})",
        *points.notes,
        f"estimated from markers beside them: {', '.join(estimates)}" if estimates else "",
        "" if {"left_shoulder", "right_shoulder"} <= set(centre) else "no shoulders: the arms are unseen",
        *more,
        *notes,
    ]
    return Evidence(
        times_s=times,
        keypoint_names=(),
        keypoints_px=np.empty((len(times), 0, 2)),
        scores=np.empty((len(times), 0)),
        joint_names=tuple(centre),
        joints_m=np.stack(list(centre.values()), axis=1),
        joints_frame="world",
        trust="mocap" if flat is None else PLANAR_TRUST,
        camera=options.camera,
        sha256=content.sha256,
        reading="; ".join(part for part in reading if part),
    )


def joints(
    content: Content, points: PointSet, flat: int | None
) -> tuple[dict[str, Array], list[str], list[str]]:
    """Joint centres and landmarks (T, 3) by name, which of them are estimates, and notes.

    Args:
        content: the file, for messages.
        points: in the world, z up, m.
        flat: the axis along which they have no depth, if any.

    Raises:
        InputError: a joint of the legs is missing.
    """
    centre, skin = points.named("centre"), points.named("skin") if points.kind == "markers" else {}
    if points.kind == "joints":
        centre, skin = _of_keypoints(points)
    notes = []
    if flat is not None:
        notes.append(planar.with_depth(centre, skin, flat, size.rough(points.near_joints())))
    estimates = centres.joints(skin, centre)
    if moved := functional.knees(points.clusters(), skin, centre) if skin else []:
        estimates += centres.joints(skin, centre)  # ankles, whose place the knees tell
        notes.append(f"found by how the bones move: {', '.join(moved)}")
    estimates += feet.ankles(skin, centre, size.rough(centre))
    if absent := [name for name in NEEDED if name not in centre or not np.isfinite(centre[name]).any()]:
        raise pointset.missing(content, points, absent[0])
    tall = size.stature_m(centre)
    notes += [centres.narrowed(centre, tall), _head(centre, tall)]
    estimates += centres.trunk(skin, centre, tall)
    notes.append(feet.soles(skin, centre, tall, shod=points.kind == "markers"))
    return centre, estimates, notes


def _of_keypoints(points: PointSet) -> tuple[dict[str, Array], dict[str, Array]]:
    """Joint centres and landmarks by name, and the points on the surface of the feet by those of markers."""
    centre, surface = points.named("centre"), {}
    named = points.named("keypoint")
    for side in size.SIDES:
        tips = [named.pop(name) for name in (f"{side}_toe", f"{side}_small_toe") if name in named]
        if tips:
            surface[f"{side}_toe_tip"] = np.mean(tips, axis=0)
        if (heel := named.pop(f"{side}_heel", None)) is not None:
            surface[f"{side}_heel"] = heel
    return named | centre, surface


def _head(centre: dict[str, Array], stature_m: float) -> str:
    """Call the point `head` what it is by its distance from the shoulders; a note for the reading."""
    if not {"head", "left_shoulder", "right_shoulder"} <= set(centre) or {"head_top", "skull_base"} & set(
        centre
    ):
        return ""
    apart = np.linalg.norm(centre["head"] - size.middle(centre, "shoulder"), axis=-1)
    if not np.isfinite(apart).any():
        return ""
    share = float(np.nanmedian(apart)) / stature_m
    places = labels.table("head")
    name = min(places, key=lambda place: abs(np.log(max(share, 1e-6) / places[place])))
    centre[name] = centre.pop("head")
    what = {"skull_base": "base of the skull", "head": "middle of the head", "head_top": "top of the head"}
    return f"head: {what[name]}, by its distance from the shoulders"
