"""Joint centres as holosoma and OmniRetarget read them: z up, metres, in the order of SMPL-X's 22 joints.

They are the joints of the average body at the person's height, whose feet stand where they stood.
"""

from __future__ import annotations

import numpy as np

from simrecon.exports import smpl, smpl_body, smplx
from simrecon.exports.amass import JOINTS
from simrecon.exports.view import ResultView
from simrecon.io import atomic


def write(view: ResultView) -> dict[str, bytes]:
    """Joint centres, and the height that the retargeter scales by."""
    scale = view.body.height_m / smplx.MEAN_M
    content = {
        "global_joint_positions": smpl.of_view(view, smpl_body.average("smplx", scale)).places_m[:, :JOINTS],
        "height": view.body.height_m,
        "joint_names": np.array(smpl.NAMES[:JOINTS]),
        "fps": view.rate_hz,
    }
    return {"holosoma.npz": atomic.npz_bytes(content)}
