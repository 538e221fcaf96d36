"""WHAM, `wham_output.pkl`: by person `pose`, `trans`, `pose_world`, `trans_world`, `betas`, `frame_ids`.

Its world is aligned with gravity, y up (the demo asks the network for it). The file holds no lens: without
the user's it is that of `compute_cam_intrinsics`. The person in the world and before the camera places it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from simrecon.evidence import people
from simrecon.evidence.camera import fov
from simrecon.evidence.content import Content
from simrecon.evidence.options import Options, times_s
from simrecon.evidence.smpl import carried
from simrecon.evidence.smpl import motion as smpl
from simrecon.evidence.smpl.motion import SmplMotion
from simrecon.evidence.values import branch
from simrecon.io.arrays import Arrays
from simrecon.types import Array, Camera, Evidence


def matches(content: Content) -> bool:
    """Whether the file is of this kind."""
    tree = content.tree
    if content.kind != "pickle" or not isinstance(tree, Mapping):
        return False
    first = next(iter(tree.values()), None)
    return isinstance(first, Mapping) and (
        "pose_world" in first or {"pose", "trans", "frame_ids"} <= set(first)
    )


def read(content: Content, options: Options) -> Evidence:
    """Evidence of one person."""
    tracks = {str(name): track for name, track in content.tree.items()}
    frames = {name: _length(track) for name, track in tracks.items()}
    person = people.choose(content, frames, options.person)
    arrays = branch(content, tracks[person], f"{person}.")
    motion = _motion(content, options, arrays, person, options.frame or "world")
    camera, note = _lens(options)
    path, notes = None, [people.named(frames, person), note]
    both = motion.frame == "world" and {f"{person}.pose", f"{person}.trans"} <= set(arrays.content)
    if both and camera is not None and camera.path is None:
        seen = _motion(content, options, arrays, person, "camera")
        path, note = _path(motion, seen, None if options.landmarks else camera)
        notes.append(note)
    text = "; ".join(filter(None, notes))
    return smpl.to_evidence(content, motion, options, up="y", camera=camera, path=path, notes=text)


def _lens(options: Options) -> tuple[Camera | None, str]:
    """The lens of the user, or WHAM's own, whose focal length is the diagonal of the image."""
    if options.camera is not None or options.size_px is None:
        return options.camera, ""
    focal = float(np.hypot(*options.size_px))
    return fov.pinhole(focal, options.size_px), f"the lens that WHAM takes for granted, {focal:.0f} px"


def _path(world: SmplMotion, seen: SmplMotion, camera: Camera | None) -> tuple[Array | None, str]:
    """The path of the camera, as far as it is to be believed, and how it moves.

    Args:
        world: the person in the world.
        seen: the same in the camera's frame.
        camera: the lens; None: landmarks place a camera that stands still.
    """
    path = carried.between(world, seen)
    moves = carried.turning(path)
    reason = carried.fault(path, world) if moves else ""
    if moves and not reason:
        return path, f"{moves}, {carried.ALONG}"
    said = f"{moves}, but it is taken for still ({reason})" if moves else ""
    still, how = (None, "") if camera is None else carried.placed(world, seen, camera)
    return still, "; ".join(filter(None, (said, how)))


def _motion(content: Content, options: Options, arrays: Arrays, person: str, frame: str) -> SmplMotion:
    suffix = "_world" if frame == "world" else ""
    rotations = smpl.pose_vectors(arrays, f"{person}.pose{suffix}", 24)
    numbers = smpl.check_frames(
        content, f"{person}.frame_ids", arrays.finite(f"{person}.frame_ids", ("T",)).astype(float)
    )
    return SmplMotion(
        model="smpl",
        frame=frame,
        times_s=times_s(content.source, numbers, options.rate_hz),
        rotations=rotations,
        trans_m=smpl.translation(arrays, f"{person}.trans{suffix}"),
    )


def _length(track: object) -> int:
    ids = track.get("frame_ids") if isinstance(track, Mapping) else None
    return int(np.size(ids)) if ids is not None else 0
