"""The kinematic optimisation of Rempe 2020, appendix B: where the paper's plans begin.

    α_proj E_proj + α_vel E_vel + α_ang E_ang + α_acc E_acc + α_data E_data + α_cont E_cont + α_floor E_floor

over root and joint angles, first without E_floor, then with the floor through the contacts (`plane`), by
trust region reflective. Ours: the skeleton is that of the fit, whose points stand for the paper's 28 joints,
and its angles are rotation vectors, which have no singularity; and the search begins at the fit, where the
paper has inverse kinematics. The paper names no units: lengths are in centimetres, as in the estimates that
it starts from, and pixels those of its focal length of 2000.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon.errors import InputError
from simrecon.kinematics import configurations, forward, layout
from simrecon.kinematics.layout import AXES, FREE
from simrecon.kinematics.resumed import resume
from simrecon.plan import Plan
from simrecon.planners.centroidal.energies import Data, rows
from simrecon.planners.centroidal.plane import Floor, through
from simrecon.planners.centroidal.points import FEET, points_of, probability
from simrecon.planners.centroidal.settings import Settings
from simrecon.types import Array, ContactLabels, Evidence, Flags, KinematicFit

SIDES = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle", "eye", "ear", "toe", "mtp", "heel")
JOINTS = (
    "nose", "neck", "pelvis", "spine", "chest", "head",
    *(f"{side}_{name}" for name in SIDES for side in ("left", "right")),
)  # fmt: skip
"""The 25 joints of OpenPose's body, and three of the spine (B.1)."""


def optimised(
    fit: KinematicFit, evidence: Evidence, plan: Plan, settings: Settings
) -> tuple[KinematicFit, Floor]:
    """The fit with the motion of appendix B, and the floor through its contacts.

    Contacts that are far from that floor are none any more. The scene stays.

    Args:
        fit: body, contacts, and where the search begins.
        evidence: on the frames of the fit.
        plan: what the evidence is worth.
        settings: of the planner.

    Raises:
        InputError: nothing in the evidence can be used, or there are no 2D landmarks.
    """
    data = prepared(fit, evidence, plan, settings)
    start = np.zeros((len(data.base), FREE))
    root, _, rotvecs = layout.from_qpos(fit.qpos)
    start[:, :AXES], start[:, AXES:] = root, np.swapaxes(rotvecs, 0, 1).reshape(len(root), -1)
    near = searched(data, start.ravel())
    soles = data.feet_m(near) - data.radii_m[:, None, None] * [0.0, 0.0, 1.0]
    floor, contact = through(soles, data.contact, settings.initial.huber, settings.initial.outlier_m)
    found = searched(replace(data, contact=contact, floor=floor), near)
    root, rotvecs, _ = layout.split(layout.from_frames(found, np.zeros(0)), len(data.base))
    qpos = layout.to_qpos(root, data.base, rotvecs)
    com = configurations(fit.body, qpos)[0]
    return replace(fit, qpos=qpos, com_m=com, contacts=_relabelled(fit, data.contact & ~contact)), floor


def prepared(fit: KinematicFit, evidence: Evidence, plan: Plan, settings: Settings) -> Data:
    """What the motion is held to, without a floor; arguments as of `optimised`."""
    see = resume(fit, evidence, plan.kinematics)[0].observations
    if see.world_to_camera is None or not np.any(see.ray_weights > 0.0):
        raise InputError(
            '[centroidal] start = "paper": found no 2D landmarks with a camera, and nothing else says where '
            'the person is there; valid: such landmarks, or start = "fit"'
        )
    root, base, rotvecs = layout.from_qpos(fit.qpos)
    pose = forward.forward(fit.body.skeleton, root, base, rotvecs, 1.0)
    feet = [point for point in points_of(fit, pose, settings) if point.name in FEET]
    known = fit.body.skeleton.point_names
    return Data(
        fit,
        base,
        np.array([known.index(name) for name in JOINTS]),
        see,
        np.array([point.segment for point in feet]),
        np.stack([point.offset_m for point in feet]),
        np.array([point.radius_m for point in feet]),
        np.stack([probability(fit, point.name) >= settings.initial.contact for point in feet]),
        None,
        settings.initial,
    )


def _relabelled(fit: KinematicFit, dropped: Flags) -> ContactLabels | None:
    if fit.contacts is None:
        return None
    labels = fit.contacts.probability.copy()
    for name, own in zip(FEET, dropped, strict=True):
        if fit.contacts.known(name):
            labels[own, fit.contacts.parts.index(name)] = 0.0
    return replace(fit.contacts, probability=labels)


def searched(data: Data, start: Array) -> Array:
    """The unknowns (T · FREE,) of the least objective near some."""
    from scipy.optimize import least_squares  # a run without this planner begins sooner

    end = least_squares(
        lambda x: rows(data, x)[0], start, lambda x: rows(data, x)[1],
        method="trf", tr_solver="lsmr", x_scale=1.0, ftol=1e-4, xtol=1e-6, gtol=1e-6,
        max_nfev=data.numbers.evaluations,
    )  # fmt: skip
    return np.asarray(end.x)
