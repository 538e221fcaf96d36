"""AMASS (SMPL-H): z up, metres, rotation vectors of 52 joints; hands are flat.

The body is SMPL's average one (betas are zero), unless the person's shape is of a body model that the user
brought: then betas are theirs. PHC, ProtoMotions, MimicKit and Blender's SMPL add-on read it.
"""

from __future__ import annotations

import numpy as np

from simrecon.exports import smpl
from simrecon.exports.view import ResultView
from simrecon.io import atomic
from simrecon.types import Array, Body

JOINTS, HANDS, BETAS = 22, 30, 16


def write(view: ResultView) -> dict[str, bytes]:
    """The motion as SMPL-H parameters."""
    pose = smpl.of_view(view, "smpl")
    body = pose.rotvecs[:, :JOINTS].reshape(len(pose.trans_m), -1)
    content = {
        "poses": np.concatenate((body, np.zeros((len(body), 3 * HANDS))), axis=1),
        "trans": pose.trans_m,
        "betas": known_betas(view.body),
        "gender": "neutral",
        "mocap_framerate": view.rate_hz,
    }
    return {"amass.npz": atomic.npz_bytes(content)}


def known_betas(body: Body) -> Array:
    """Shape parameters (16,) of a body model that is not simrecon's own; else zero."""
    betas = np.zeros(BETAS)
    if body.shape_space not in ("", "simrecon"):
        betas[: len(body.betas)] = body.betas[:BETAS]
    return betas
