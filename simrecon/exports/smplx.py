"""SMPL-X as GMR and AMASS' SMPL-X files have it: z up, metres, rotation vectors of the body's 22 joints.

GMR takes the person's height from the first beta, 1.66 m + 0.1 m times it; so that is written, and the joints
are those of the average body at that height. If the person's shape is of an SMPL-X model that the user
brought, betas and joints are the person's.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon.exports import smpl, smpl_body
from simrecon.exports.amass import JOINTS
from simrecon.exports.smpl_body import SmplBody
from simrecon.exports.view import ResultView
from simrecon.io import atomic

MEAN_M, PER_BETA_M, BETA_MAX = 1.66, 0.1, 3.0


def write(view: ResultView) -> dict[str, bytes]:
    """The motion as SMPL-X parameters."""
    person = smpl_body.own(view, "smplx") or of_height(view.body.height_m)
    pose = smpl.of_view(view, person)
    turns = pose.rotvecs[:, :JOINTS]
    content = {
        "gender": person.gender,
        "surface_model_type": "smplx",
        "betas": person.betas,
        "root_orient": turns[:, 0],
        "pose_body": turns[:, 1:].reshape(len(turns), -1),
        "trans": pose.trans_m,
        "mocap_frame_rate": view.rate_hz,
    }
    return {"smplx.npz": atomic.npz_bytes(content)}


def of_height(height_m: float) -> SmplBody:
    """The average body at the height that its first beta says by GMR's rule."""
    first = float(np.clip((height_m - MEAN_M) / PER_BETA_M, -BETA_MAX, BETA_MAX))
    body = smpl_body.average("smplx", (MEAN_M + PER_BETA_M * first) / MEAN_M)
    return replace(body, betas=np.array([first, *body.betas[1:]]))
