"""What forces do not explain of the motion of a full body."""

from __future__ import annotations

import numpy as np

from simrecon.kinematics import forward
from simrecon.kinematics.layout import from_qpos
from simrecon.planners.soft_contact.masses import Masses
from simrecon.planners.soft_contact.physics import GRAVITY
from simrecon.types import Array, Body


def wrench(body: Body, qpos: Array, times_s: Array, places_m: Array, force_N: Array) -> Array:
    """Force and moment (T, 6) on the root that the motion needs beyond gravity and forces.

    Args:
        body: of the person.
        qpos: (T, nq) configurations, by second differences.
        times_s: (T,) uniform.
        places_m: (T, C, 3) where forces act.
        force_N: (T, C, 3).
    """
    root, base, rotvecs = from_qpos(qpos)
    masses = Masses.of(body)
    pose = forward.forward(body.skeleton, root, base, rotvecs, 1.0)
    points = forward.points(pose, masses.segments, masses.offsets_m)  # (N, T, 3)
    dt = float(times_s[1] - times_s[0])
    acceleration = (points[:, 2:] - 2 * points[:, 1:-1] + points[:, :-2]) / dt**2
    push = masses.mass_kg[:, None, None] * (acceleration - GRAVITY)
    arms = points[:, 1:-1] - root[1:-1]
    lever = places_m[1:-1] - root[1:-1, None]
    force = push.sum(axis=0) - force_N[1:-1].sum(axis=1)
    moment = forward.cross(arms, push).sum(axis=0) - forward.cross(lever, force_N[1:-1]).sum(axis=1)
    inner = np.concatenate((force, moment), axis=1)
    return np.concatenate((inner[:1], inner, inner[-1:]))
