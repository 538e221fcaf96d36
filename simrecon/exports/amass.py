"""AMASS (SMPL-H): z up, metres, rotation vectors of 52 joints; hands are flat.

The body is SMPL's average one (betas are zero), unless the person's shape is of a body model of SMPL or
SMPL-H that the user brought: then it is the person's, with their betas. PHC, ProtoMotions, MimicKit and
Blender's SMPL add-on read it.
"""

from __future__ import annotations

import numpy as np

from simrecon.exports import smpl, smpl_body
from simrecon.exports.view import ResultView
from simrecon.io import atomic

JOINTS, HANDS = 22, 30


def write(view: ResultView) -> dict[str, bytes]:
    """The motion as SMPL-H parameters."""
    person = smpl_body.own(view, "smpl") or smpl_body.average("smpl")
    pose = smpl.of_view(view, person)
    body = pose.rotvecs[:, :JOINTS].reshape(len(pose.trans_m), -1)
    content = {
        "poses": np.concatenate((body, np.zeros((len(body), 3 * HANDS))), axis=1),
        "trans": pose.trans_m,
        "betas": person.betas,
        "gender": person.gender,
        "mocap_framerate": view.rate_hz,
    }
    return {"amass.npz": atomic.npz_bytes(content)}
