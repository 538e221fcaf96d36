"""ProtoMotions' `.motion`: the state of SMPL's humanoid, body by body, with the contacts that there were.

z up, metres, quaternions x y z w. Bodies have the axes of our segments: x forward and z up in a T-pose. Their
own converter guesses contacts by height and speed; here they are what the scene pushed.
"""

from __future__ import annotations

import numpy as np

from simrecon.exports import segments, smpl, smpl_body
from simrecon.exports.axes import LOCAL
from simrecon.exports.view import ResultView
from simrecon.geometry import rotations
from simrecon.io import torch_file

BODIES = {
    "Pelvis": "pelvis",
    "L_Hip": "left_hip", "L_Knee": "left_knee", "L_Ankle": "left_ankle", "L_Toe": "left_foot",
    "R_Hip": "right_hip", "R_Knee": "right_knee", "R_Ankle": "right_ankle", "R_Toe": "right_foot",
    "Torso": "spine1", "Spine": "spine2", "Chest": "spine3", "Neck": "neck", "Head": "head",
    "L_Thorax": "left_collar", "L_Shoulder": "left_shoulder", "L_Elbow": "left_elbow",
    "L_Wrist": "left_wrist", "L_Hand": "left_hand",
    "R_Thorax": "right_collar", "R_Shoulder": "right_shoulder", "R_Elbow": "right_elbow",
    "R_Wrist": "right_wrist", "R_Hand": "right_hand",
}  # fmt: skip
"""Bodies in the order of their humanoid, and SMPL's joints."""
ORDER = [smpl.NAMES.index(joint) for joint in BODIES.values()]
PARENTS = [ORDER.index(smpl.PARENTS[row]) if smpl.PARENTS[row] >= 0 else -1 for row in ORDER]
XYZW = [1, 2, 3, 0]


def write(view: ResultView) -> dict[str, bytes]:
    """The motion of the average body's humanoid."""
    pose = smpl.of_view(view, smpl_body.average("smpl"))
    places = pose.places_m[:, ORDER]
    quats = rotations.multiply(pose.quats, rotations.from_matrix(LOCAL))[:, ORDER]
    local = segments.local(PARENTS, quats)
    names = view.body.skeleton.names
    of = [names.index(smpl.segment_of(joint)) for joint in BODIES.values()]
    count, interval_s = len(places), view.interval_s
    content = {
        "rigid_body_pos": places,
        "rigid_body_rot": rotations.canonical(quats)[..., XYZW],
        "rigid_body_vel": segments.rates(places, interval_s),
        "rigid_body_ang_vel": segments.turn_rates(quats, interval_s),
        "dof_pos": rotations.log(local[:, 1:]).reshape(count, -1),
        "dof_vel": segments.turn_rates(local[:, 1:], interval_s).reshape(count, -1),
        "local_rigid_body_rot": local[..., XYZW],
    }
    tensors = {key: np.asarray(values, np.float32) for key, values in content.items()}
    contacts = np.ascontiguousarray(view.touching[:, of])
    file = torch_file.dumps({"fps": view.rate_hz, **tensors, "rigid_body_contacts": contacts})
    return {"protomotions.motion": file}
