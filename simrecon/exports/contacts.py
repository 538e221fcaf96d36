"""When each segment touches: pushed by the scene in the simulation, or resting on it in the kinematic fit."""

from __future__ import annotations

import numpy as np

from simrecon.contact import parts, rules
from simrecon.kinematics.touched import labels, touched
from simrecon.results import Result, kinematic
from simrecon.types import Array, Body, Flags, Motion

SURELY = 0.5
"""How surely a part of the fit touches, from which on it counts as touching."""


def touching(result: Result, of: str, times_s: Array) -> Flags:
    """Segments (G, S) that touch the scene, at the nearest frame of the result.

    Args:
        result: whose motion.
        of: `simulation` or `fit`.
        times_s: (G,).
    """
    motion, body = result.motion, result.body
    at = np.abs(motion.times_s - times_s[:, None]).argmin(axis=1)
    if of == "simulation":
        return np.asarray(_pushed(motion, body)[at])
    fitted = motion.qpos if motion.kinematic_qpos is None else motion.kinematic_qpos
    qpos = fitted[:, : kinematic.coordinates(body)]
    surely = labels(touched(body, result.scene, qpos, motion.times_s), None, None).probability
    own = {part.name: body.skeleton.names.index(part.segment) for part in body.primitives}
    flags = np.zeros((len(motion.times_s), len(body.skeleton.names)), dtype=np.bool_)
    for column, part in enumerate(parts.parts()):
        for primitive in part.at:
            flags[:, own[primitive]] |= surely[:, column] > SURELY
    return np.asarray(flags[at])


def _pushed(motion: Motion, body: Body) -> Flags:
    """Segments (T, S) with a primitive that is loaded."""
    loaded = rules.loaded(np.linalg.norm(motion.contact_force_N, axis=-1))  # (T, C)
    own = {part.name: part.segment for part in body.primitives}
    of = np.array([own[name] for name in motion.contact_body])
    return np.stack([loaded[:, of == name].any(axis=1) for name in body.skeleton.names], axis=1)
