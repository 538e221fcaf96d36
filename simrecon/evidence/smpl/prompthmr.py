"""PromptHMR, `results.pkl`: by person `frames`, `smplx_world` {`pose`, `shape`, `trans`}; `camera_world`.

Its world is the gravity-aligned first camera with y and z turned round: y up, the floor fitted to y = 0.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from simrecon.evidence import people
from simrecon.evidence.content import Content
from simrecon.evidence.options import Options, times_s
from simrecon.evidence.smpl import carried
from simrecon.evidence.smpl import motion as smpl
from simrecon.evidence.smpl.motion import SmplMotion
from simrecon.evidence.values import branch
from simrecon.io.arrays import Arrays
from simrecon.io.messages import counted
from simrecon.types import Array, Camera, Evidence

STILL = 0.02


def matches(content: Content) -> bool:
    """Whether the file is of this kind."""
    tree = content.tree
    if not isinstance(tree, Mapping) or not isinstance(tree.get("people"), Mapping):
        return False
    return "camera_world" in tree or any(
        isinstance(track, Mapping) and "smplx_world" in track for track in tree["people"].values()
    )


def read(content: Content, options: Options) -> Evidence:
    """Evidence of one person."""
    tracks = {str(name): track for name, track in content.tree["people"].items()}
    for name, track in tracks.items():
        if not isinstance(track, Mapping):
            raise content.fail(f"people.{name}", f"a {type(track).__name__}", "a dictionary of arrays")
    frames = {name: int(np.size(track.get("frames", ()))) for name, track in tracks.items()}
    person = people.choose(content, frames, options.person)
    motion = _motion(content, options, tracks[person], person, options.frame or "world")
    seen = None
    if motion.frame == "world" and isinstance(tracks[person].get("smplx_cam"), Mapping):
        seen = _motion(content, options, tracks[person], person, "camera")
    camera, path, note = _camera(content, options, tracks[person], motion, seen)
    notes = ", ".join(part for part in (people.named(frames, person), note) if part)
    return smpl.to_evidence(content, motion, options, up="y", camera=camera, path=path, notes=notes)


def _motion(
    content: Content, options: Options, person: Mapping[str, object], name: str, frame: str
) -> SmplMotion:
    group = "smplx_world" if frame == "world" else "smplx_cam"
    prefix = f"people.{name}.{group}."
    arrays = branch(content, person.get(group), prefix)
    if f"{prefix}pose" in arrays or f"{prefix}rotmat" not in arrays:
        rotations = smpl.pose_vectors(arrays, f"{prefix}pose", 22)
    else:
        rotations = smpl.pose_matrices(arrays, f"{prefix}rotmat", 55)[:, :22]
    numbers = branch(content, person, f"people.{name}.").finite(f"people.{name}.frames", ("T",))
    if len(numbers) != len(rotations):
        text = f"{counted(len(numbers), 'frame')} for {counted(len(rotations), 'pose')}"
        raise content.fail(f"people.{name}.frames", text, "one for each pose")
    numbers = smpl.check_frames(content, f"people.{name}.frames", numbers)
    return SmplMotion(
        model="smplx",
        frame=frame,
        times_s=times_s(content.source, numbers, options.rate_hz),
        rotations=rotations,
        trans_m=smpl.translation(arrays, f"{prefix}trans"),
    )


def _camera(
    content: Content,
    options: Options,
    person: Mapping[str, object],
    motion: SmplMotion,
    seen: SmplMotion | None,
) -> tuple[Camera | None, Array | None, str]:
    """Lens and path, and what of them is used."""
    if "camera_world" not in content.tree:
        return options.camera, None, ""
    arrays = branch(content, content.tree["camera_world"], "camera_world.")
    lens, note = _lens(arrays, options)
    if "camera_world.Rwc" not in arrays or lens is None:
        return lens, None, note
    turns = arrays.finite("camera_world.Rwc", ("N", 3, 3))
    numbers = np.asarray(person["frames"], np.int64)
    known = bool(numbers.min() >= 0 and numbers.max() < len(turns))
    if np.abs(turns - turns[:1]).max() <= STILL:
        if motion.frame == "camera" or not known or "camera_world.Twc" not in arrays:
            return lens, None, note
        places = arrays.finite("camera_world.Twc", ("N", 3))
        path, where = carried.at_rest(turns[numbers], places[numbers], motion, lens, options)
        return lens, path, "; ".join(filter(None, (note, where and f"the camera: {where}")))
    if "camera_world.Twc" not in arrays:
        return carried.choose(lens, None, "the camera moves", "the file has no Twc")
    places = arrays.finite("camera_world.Twc", ("N", 3))
    if motion.frame == "camera":
        return carried.choose(lens, None, "the camera moves", carried.EACH_FRAME)
    if not known:
        reason = f"it has {counted(len(turns), 'frame')} for frame numbers to {numbers.max()}"
        return carried.choose(lens, None, "the camera moves", reason)
    path = carried.along(turns[numbers], places[numbers])
    camera, used, text = carried.choose(lens, path, "the camera moves", carried.fault(path, motion, seen))
    return camera, used, "; ".join(filter(None, (note if camera is not None else "", text)))


def _lens(arrays: Arrays, options: Options) -> tuple[Camera | None, str]:
    if options.camera is not None:
        return options.camera, ""
    if "camera_world.img_focal" not in arrays or "camera_world.img_center" not in arrays:
        return None, ""
    focal = arrays.finite("camera_world.img_focal", ())
    centre = arrays.finite("camera_world.img_center", (2,))
    return smpl.lens(float(focal), centre), f"focal length {float(focal):.0f} px"
