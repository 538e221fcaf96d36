"""The motion of a result at a uniform frame rate, and its world y up, as other programs want them."""

from __future__ import annotations

from simrecon.evidence.axes import to_z_up
from simrecon.results import Result, kinematic
from simrecon.types import Array

TO_Y_UP = to_z_up("y").T
"""Our world (z up) to one with y up, as `evidence` reads it back."""


def uniform_motion(result: Result) -> tuple[Array, Array]:
    """Times (G,) and the person's configurations (G, nq) there; between frames by interpolation."""
    motion, body = result.motion, result.body
    times_s = kinematic.uniform(motion.times_s)[0].times_s
    qpos = kinematic.on_clock(motion.times_s, motion.qpos[:, : kinematic.coordinates(body)], times_s)
    return times_s, qpos
