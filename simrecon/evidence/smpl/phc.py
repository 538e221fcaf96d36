"""PHC and its relatives (PULSE, SMPLSim): a joblib file of motions by name, made of AMASS.

By motion `pose_aa` (T, 72), rotation vectors of SMPL's joints in SMPL's order, `root_trans_offset` (T, 3),
where the pelvis is, or `trans_orig`, the translation of SMPL, and `fps`; z up (scripts/data_process/
convert_amass_isaac.py of PHC). What was converted for a robot has other joints, and `dof`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from simrecon.evidence import people
from simrecon.evidence.content import Content
from simrecon.evidence.options import Options, times_s
from simrecon.evidence.smpl import motion as smpl
from simrecon.evidence.smpl.motion import SmplMotion
from simrecon.evidence.values import branch
from simrecon.types import Evidence

WIDTH = 72
RATE_RANGE_HZ = (2.0, 2000.0)


def matches(content: Content) -> bool:
    """Whether the file holds PHC's motions."""
    return any("pose_aa" in motion for motion in list(_motions(content).values())[:8])


def _motions(content: Content) -> dict[str, Mapping[str, Any]]:
    """By name; the file of a single motion has none."""
    tree = content.tree if content.kind == "pickle" else None
    if not isinstance(tree, Mapping):
        return {}
    if "pose_aa" in tree:
        return {"motion": tree}
    return {str(name): motion for name, motion in tree.items() if isinstance(motion, Mapping)}


def read(content: Content, options: Options) -> Evidence:
    """Evidence of one motion."""
    motions = _motions(content)
    frames = {name: int(np.shape(motion.get("pose_aa", ()))[0]) for name, motion in motions.items()}
    name = people.choose(content, {key: count for key, count in frames.items() if count}, options.person)
    if "dof" in motions[name]:
        there = "joint angles of a robot (dof)"
        raise content.fail(name, there, "a motion of SMPL's body, pose_aa (T, 72)")
    arrays = branch(content, motions[name], f"{name}.")
    poses = arrays.array(f"{name}.pose_aa")
    if poses.ndim not in (2, 3) or int(np.prod(poses.shape[1:])) != WIDTH:
        arrays.fail(f"{name}.pose_aa", f"shape {poses.shape}", f"(T, {WIDTH}) or (T, 24, 3)")
    rate = options.fps
    if rate is None and f"{name}.fps" in arrays:
        rate = arrays.scalar(f"{name}.fps", RATE_RANGE_HZ, "Hz")
    rate = options.video_fps if rate is None else rate
    offset = f"{name}.root_trans_offset"
    place = smpl.translation(arrays, offset if offset in arrays else f"{name}.trans_orig")
    motion = SmplMotion(
        model="smpl",
        frame="world",
        times_s=times_s(content.source, np.arange(len(poses)), rate),
        rotations=smpl.pose_vectors(arrays, f"{name}.pose_aa", 24),
        trans_m=place - smpl.offsets_m("smpl")[0] if offset in arrays else place,
    )
    note = people.named(frames, name).replace("person", "motion", 1)
    notes = "; ".join(part for part in (note, f"{rate:g} Hz") if part)
    return replace(smpl.to_evidence(content, motion, options, up="z", notes=notes), trust="mocap")
