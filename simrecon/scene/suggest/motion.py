"""What the rules look at: pelvis, trunk and soles of a motion, and how fast they move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from simrecon.body.primitives import FEET
from simrecon.geometry import rotations
from simrecon.sim.models import compile_text
from simrecon.sim.poses import posed
from simrecon.types import Array, Body, Flags, runs

_SMOOTH_S = 0.08


@dataclass(frozen=True, eq=False)
class Motion:
    """The parts of a motion that the rules look at.

    Attributes:
        times_s: (T,) uniform.
        pelvis_m: (T, 3) its origin; facing: (T, 2) unit vectors to the front, seen from above.
        tilt_rad: (T,) angle of the trunk with the vertical.
        under_m: (T,) lowest point of pelvis and buttocks.
        soles_m: (2, T, 4, 3) corners of both soles.
    """

    times_s: Array
    pelvis_m: Array
    facing: Array
    tilt_rad: Array
    under_m: Array
    soles_m: Array


def measure(person: Body, times_s: Array, qpos: Array) -> Motion:
    """Where pelvis and soles are in a kinematic motion.

    Args:
        person: whose motion it is.
        times_s: (T,) uniform.
        qpos: (T, 7 + 4 * 16) configurations.
    """
    model = compile_text(person.mjcf)
    seat = [model.geom(name).id for name in ("pelvis", "left_buttock", "right_buttock")]
    feet = [model.geom(foot).id for foot in FEET]
    chest = model.body("neck").id
    frames = len(qpos)
    under, soles, trunk = np.empty(frames), np.empty((2, frames, 4, 3)), np.empty((frames, 3))
    signs = np.array([[x, y, -1.0] for x in (-1, 1) for y in (-1, 1)])
    for frame, data in enumerate(posed(model, qpos)):
        axes = data.geom_xmat.reshape(-1, 3, 3)
        reach = model.geom_size[seat, 0] + model.geom_size[seat, 1] * np.abs(axes[seat, 2, 2])
        under[frame] = (data.geom_xpos[seat, 2] - reach).min()
        for side, foot in enumerate(feet):
            soles[side, frame] = data.geom_xpos[foot] + (signs * model.geom_size[foot]) @ axes[foot].T
        trunk[frame] = data.xpos[chest] - qpos[frame, :3]
    forward = rotations.matrix(qpos[:, 3:7])[:, :2, 0]  # (T, 2)
    facing = forward / np.maximum(np.linalg.norm(forward, axis=1, keepdims=True), 1e-9)
    tilt = np.arccos(np.clip(trunk[:, 2] / np.linalg.norm(trunk, axis=1), -1, 1))
    return Motion(times_s, qpos[:, :3], facing, tilt, under, soles)


def speed_mps(places_m: Array, times_s: Array) -> Array:
    """Smoothed speeds (T,) of points (T, 3)."""
    interval = float(times_s[1] - times_s[0])
    smooth = gaussian_filter1d(places_m, _SMOOTH_S / interval, axis=0, mode="nearest")
    return np.asarray(np.linalg.norm(np.gradient(smooth, interval, axis=0), axis=1))


def spans(chosen: Flags, times_s: Array, least_s: float) -> list[tuple[int, int]]:
    """First and last frames of the runs of chosen frames (T,) that last at least `least_s`."""
    found = [(rows.start, rows.stop - 1) for rows in runs(chosen)]
    return [(first, last) for first, last in found if times_s[last] - times_s[first] >= least_s]
