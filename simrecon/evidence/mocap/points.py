"""Evidence of points of a body in a file's own unit and axes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from simrecon import body as bodies
from simrecon.evidence.axes import find_unit, find_up, metres, to_z_up
from simrecon.evidence.content import Content
from simrecon.evidence.options import Options
from simrecon.geometry import vectors
from simrecon.io.messages import counted
from simrecon.types import Array, Evidence

NEEDED = tuple(
    f"{side}_{joint}" for joint in ("hip", "knee", "ankle", "shoulder") for side in ("left", "right")
)
STANCE_COSINE = np.cos(np.radians(30.0))
"""In a rest pose that is a person's who stands, both legs are that much along the trunk."""


def points_evidence(
    content: Content,
    options: Options,
    points: dict[str, Array],
    times: Array,
    unit: str | None = None,
    notes: str = "",
    rest: Mapping[str, Array] | None = None,
    stated: Mapping[str, float] | None = None,
) -> Evidence:
    """Evidence of points of a body in the file's own unit and axes.

    Args:
        content: the file.
        options: of the user.
        points: (T, 3) by name; NaN = unknown.
        times: (T,) s.
        unit: that the file states, or None.
        notes: on how the file was read.
        rest: (3,) by name in the rest pose, where there is one.
        stated: lengths that the file states of the person, in its unit.
    """
    joints = np.stack(list(points.values()), axis=1)  # (T, K, 3)
    axis, how = find_up(content.source, upright(points), options.up, stance(rest), joints)
    seen = Evidence(
        times_s=times,
        keypoint_names=(),
        keypoints_px=np.empty((len(times), 0, 2)),
        scores=np.empty((len(times), 0)),
        joint_names=tuple(points),
        joints_m=joints @ to_z_up(axis).T,
        joints_frame="world",
        lengths_m=tuple((stated or {}).items()),
        trust="mocap",
        camera=options.camera,
        sha256=content.sha256,
    )
    unit_name, unit_how = find_unit(content.source, stature(seen), options.unit, unit, options.height_m)
    metre = metres(unit_name)
    reading = f"{counted(len(points), 'joint')}, unit {unit_name} ({unit_how}), up {axis} ({how})"
    return replace(
        seen,
        joints_m=seen.joints_m * metre,
        lengths_m=tuple((name, metre * length) for name, length in seen.lengths_m),
        reading="; ".join(part for part in (reading, notes) if part),
    )


def upright(points: Mapping[str, Array]) -> Array:
    """From the middle of the ankles to that of the shoulders, (T, 3)."""
    return _middle(points, "shoulder") - _middle(points, "ankle")


def stance(rest: Mapping[str, Array] | None) -> Array | None:
    """From the ankles to the shoulders (3,) in a rest pose, if that is one of a person who stands.

    Some programs write offsets along the axes of each bone, and their rest pose means nothing.
    """
    if rest is None:
        return None
    trunk = vectors.unit(_middle(rest, "shoulder") - _middle(rest, "hip"))
    for side in ("left", "right"):
        leg = vectors.unit(rest[f"{side}_hip"] - rest[f"{side}_ankle"])
        if not float(leg @ trunk) >= STANCE_COSINE:
            return None
    return upright(rest)


def stature(seen: Evidence) -> float:
    """Height of a person with the lengths of evidence, in its unit.

    It is that of the body with these lengths, with the base of the skull as far over the shoulders as the
    evidence has it, where it has one: necks differ, and few rigs put their joint where a body has it.
    """
    skeleton = bodies.scaled(bodies.measure(seen))
    total = bodies.stature_m(skeleton)
    points = {name: seen.joints_m[:, i] for i, name in enumerate(seen.joint_names)}
    if "skull_base" not in points:
        return total
    shoulders = _middle(points, "shoulder")
    up = vectors.unit(shoulders - _middle(points, "hip"))
    raised = np.sum((points["skull_base"] - shoulders) * up, axis=-1)
    model = dict(zip(skeleton.names, bodies.t_pose_m(skeleton)[:, 2].tolist(), strict=True))
    expected = float(model["head"] - model["left_shoulder"])
    return total + float(np.nanmedian(raised)) - expected


def _middle(points: Mapping[str, Array], joint: str) -> Array:
    middle: Array = (points[f"left_{joint}"] + points[f"right_{joint}"]) / 2
    return middle
