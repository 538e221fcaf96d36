"""AMASS in both spellings, and plain files of SMPL, SMPL+H or SMPL-X parameters.

AMASS: `poses` (T, 156) or (T, 165), `trans`, `betas`, `mocap_framerate`; or `root_orient`, `pose_body`,
`trans` and `mocap_frame_rate`. Its world is z up. A plain file may name the same things in any of the ways
below; which axis points up in it is found from the body, or asked for.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from simrecon.evidence.content import Content
from simrecon.evidence.options import Options, times_s
from simrecon.evidence.smpl import motion as smpl
from simrecon.evidence.smpl.motion import SmplMotion
from simrecon.evidence.values import branch
from simrecon.io.arrays import Arrays
from simrecon.types import Array, Evidence

RATES = ("mocap_framerate", "mocap_frame_rate")
PLAIN_RATES = (*RATES, "fps", "framerate", "frame_rate", "frameRate")
WHOLE = ("poses", "pose", "thetas", "smpl_poses", "full_pose")
ROOTS = ("root_orient", "global_orient", "root_pose")
BODIES = ("pose_body", "body_pose")
PLACES = ("trans", "transl", "translation", "smpl_trans", "root_trans")
RATE_RANGE_HZ = (2.0, 2000.0)


def matches_amass(content: Content) -> bool:
    """Whether the file is AMASS'."""
    return _has(content, RATES) is not None and matches_smpl(content)


def matches_smpl(content: Content) -> bool:
    """Whether the file holds SMPL parameters with plain names."""
    whole = _has(content, WHOLE) is not None or (
        _has(content, ROOTS) is not None and _has(content, BODIES) is not None
    )
    return whole and _has(content, PLACES) is not None


def _has(content: Content, keys: tuple[str, ...]) -> str | None:
    tree = content.tree
    return next((key for key in keys if key in tree), None) if isinstance(tree, Mapping) else None


def read_amass(content: Content, options: Options) -> Evidence:
    """Evidence of an AMASS file."""
    return replace(_read(content, options, "z"), trust="mocap")


def read_smpl(content: Content, options: Options) -> Evidence:
    """Evidence of a plain file."""
    return _read(content, options, None)


def _read(content: Content, options: Options, up: str | None) -> Evidence:
    arrays = branch(content, content.tree, "")
    place = _has(content, PLACES)
    if place is None:
        raise content.fail(PLACES[0], "no such key", f"one of {', '.join(PLACES)}")
    model, rotations = _pose(content, arrays)
    fps = options.fps
    if fps is None and (rate := _has(content, PLAIN_RATES)) is not None:
        fps = arrays.scalar(rate, RATE_RANGE_HZ, "Hz")
    fps = options.video_fps if fps is None else fps
    motion = SmplMotion(
        model=model,
        frame=options.frame or "world",
        times_s=times_s(content.source, np.arange(len(rotations)), fps),
        rotations=rotations,
        trans_m=smpl.translation(arrays, place),
    )
    note = "" if fps is None else f"{fps:g} Hz"
    return smpl.to_evidence(content, motion, options, up=up, camera=options.camera, notes=note)


def _pose(content: Content, arrays: Arrays) -> tuple[str, Array]:
    """The model and the joints' rotations."""
    root, body = _has(content, ROOTS), _has(content, BODIES)
    if root is not None and body is not None:
        width = int(np.prod(arrays.array(body).shape[1:]))
        model = "smpl" if width == 69 else "smplx"
        if _stated(arrays) is not None:
            model = str(_stated(arrays))
        count = 23 if width == 69 else 21
        parts = smpl.pose_vectors(arrays, root, 1), smpl.pose_vectors(arrays, body, count)
        return model, np.concatenate(parts, axis=1)
    key = _has(content, WHOLE)
    if key is None:
        raise content.fail(
            WHOLE[0], "no such key", f"one of {', '.join(WHOLE)}, or root_orient and pose_body"
        )
    width = int(np.prod(arrays.array(key).shape[1:]))
    models = {72: ("smpl", 24), 156: ("smpl", 22), 165: ("smplx", 22), 66: ("smpl", 22)}
    if width not in models:
        sizes = ", ".join(f"(T, {size})" for size in sorted(models))
        arrays.fail(key, f"shape {arrays.array(key).shape}", sizes)
    model, count = models[width]
    return _stated(arrays) or model, smpl.pose_vectors(arrays, key, count)


def _stated(arrays: Arrays) -> str | None:
    if "surface_model_type" not in arrays:
        return None
    return "smplx" if "smplx" in str(arrays.array("surface_model_type")).lower() else "smpl"
