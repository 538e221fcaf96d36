"""WHAM, `wham_output.pkl`: by person `pose`, `trans`, `pose_world`, `trans_world`, `betas`, `frame_ids`.

Its world is aligned with gravity, y up (the demo asks the network for it). The file holds no lens.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from simrecon.evidence import people
from simrecon.evidence.content import Content, branch
from simrecon.evidence.options import Options, times_s
from simrecon.evidence.smpl import motion as smpl
from simrecon.evidence.smpl.motion import SmplMotion
from simrecon.types import Evidence


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
    frame = options.frame or "world"
    suffix = "_world" if frame == "world" else ""
    rotations = smpl.pose_vectors(arrays, f"{person}.pose{suffix}", 24)
    numbers = smpl.check_frames(
        content, f"{person}.frame_ids", arrays.finite(f"{person}.frame_ids", ("T",)).astype(float)
    )
    found = SmplMotion(
        model="smpl",
        frame=frame,
        times_s=times_s(content.source, numbers, options.rate_hz),
        rotations=rotations,
        trans_m=smpl.translation(arrays, f"{person}.trans{suffix}"),
        betas=smpl.betas(arrays, f"{person}.betas"),
    )
    return smpl.to_evidence(
        content, found, options, up="y", camera=options.camera, notes=people.named(frames, person)
    )


def _length(track: object) -> int:
    ids = track.get("frame_ids") if isinstance(track, Mapping) else None
    return int(np.size(ids)) if ids is not None else 0
