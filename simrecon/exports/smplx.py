"""SMPL-X as GMR and AMASS' SMPL-X files have it: z up, metres, rotation vectors of the body's 22 joints.

GMR takes the person's height from the first beta, 1.66 m + 0.1 m times it; so that is written, and the joints
are those of the average body at that height. A shape of a body model that the user brought is kept as it is.
"""

from __future__ import annotations

import numpy as np

from simrecon.exports import smpl
from simrecon.exports.amass import JOINTS, known_betas
from simrecon.exports.view import ResultView
from simrecon.io import atomic
from simrecon.types import Array, Body

MEAN_M, PER_BETA_M, BETA_MAX = 1.66, 0.1, 3.0


def write(view: ResultView) -> dict[str, bytes]:
    """The motion as SMPL-X parameters."""
    betas = betas_of(view.body)
    pose = smpl.of_view(view, "smplx", (MEAN_M + PER_BETA_M * float(betas[0])) / MEAN_M)
    turns = pose.rotvecs[:, :JOINTS]
    content = {
        "gender": "neutral",
        "surface_model_type": "smplx",
        "betas": betas,
        "root_orient": turns[:, 0],
        "pose_body": turns[:, 1:].reshape(len(turns), -1),
        "trans": pose.trans_m,
        "mocap_frame_rate": view.rate_hz,
    }
    return {"smplx.npz": atomic.npz_bytes(content)}


def betas_of(body: Body) -> Array:
    """Shape parameters (16,): those of the user's body model, or the one that gives the height."""
    betas = known_betas(body)
    if not betas.any():
        betas[0] = np.clip((body.height_m - MEAN_M) / PER_BETA_M, -BETA_MAX, BETA_MAX)
    return betas
