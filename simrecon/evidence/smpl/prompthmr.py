"""PromptHMR, `results.pkl`: by person `frames`, `smplx_world` {`pose`, `shape`, `trans`}; `camera_world`.

Its world is the gravity-aligned first camera with y and z turned round: y up, the floor fitted to y = 0.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from simrecon.evidence import people
from simrecon.evidence.content import Content, branch
from simrecon.evidence.options import Options, times_s
from simrecon.evidence.smpl import motion as smpl
from simrecon.evidence.smpl.motion import SmplMotion
from simrecon.types import Camera, Evidence

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
    frame = options.frame or "world"
    group = "smplx_world" if frame == "world" else "smplx_cam"
    prefix = f"people.{person}.{group}."
    arrays = branch(content, tracks[person].get(group), prefix)
    if f"{prefix}pose" in arrays or f"{prefix}rotmat" not in arrays:
        rotations = smpl.pose_vectors(arrays, f"{prefix}pose", 22)
    else:
        rotations = smpl.pose_matrices(arrays, f"{prefix}rotmat", 55)[:, :22]
    track = branch(content, tracks[person], f"people.{person}.")
    numbers = track.finite(f"people.{person}.frames", ("T",))
    if len(numbers) != len(rotations):
        found_text = f"{len(numbers)} frames for {len(rotations)} poses"
        raise content.fail(f"people.{person}.frames", found_text, "one for each pose")
    found = SmplMotion(
        model="smplx",
        frame=frame,
        times_s=times_s(
            content.source, smpl.check_frames(content, f"people.{person}.frames", numbers), options.rate_hz
        ),
        rotations=rotations,
        trans_m=smpl.translation(arrays, f"{prefix}trans"),
        betas=smpl.betas(arrays, f"{prefix}shape"),
    )
    camera, note = _camera(content, options)
    notes = ", ".join(part for part in (people.named(frames, person), note) if part)
    return smpl.to_evidence(content, found, options, up="y", camera=camera, notes=notes)


def _camera(content: Content, options: Options) -> tuple[Camera | None, str]:
    if options.camera is not None or "camera_world" not in content.tree:
        return options.camera, ""
    arrays = branch(content, content.tree["camera_world"], "camera_world.")
    if "camera_world.Rwc" in arrays:
        turned = arrays.finite("camera_world.Rwc", ("N", 3, 3))
        if np.abs(turned - turned[:1]).max() > STILL:
            return None, "the camera moves, so its lens is not used"
    if "camera_world.img_focal" not in arrays or "camera_world.img_center" not in arrays:
        return None, ""
    focal = arrays.finite("camera_world.img_focal", ())
    centre = arrays.finite("camera_world.img_center", (2,))
    return smpl.lens(float(focal), centre), f"focal length {float(focal):.0f} px"
