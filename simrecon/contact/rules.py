"""What touches and what rests, by rules of speed, height and force: all of them, and nowhere else.

`still` is of evidence alone, before anything is fitted; `touching` and `held` are of a body in a scene, as
probabilities; the others are flags, of references (`rests`, `reference_contacts`, `touches`), of what is
suggested for a scene (`stands`, `seated`) and of forces (`loaded`). Axes: T frames, M points, F foot points;
leading axes are batches.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from simrecon.types import Array, Flags

# Evidence: points that move less than this are still, smoothed against noise.
STILL_MPS, STILL_SMOOTH_S = 0.4, 0.04
# A posed body touches what is nearer than this, or no deeper than that; it is held if it is slower than this.
TOUCH_M, SUNK_M, SLOW_MPS = 0.02, 0.05, 0.2
# Reference contact: near the lowest height of the foot point in the reference, and slow there.
CONTACT_PERCENTILE, CONTACT_HEIGHT_M, CONTACT_SPEED_MPS = 5.0, 0.03, 0.15
# Who sits down comes up by more than this; within this of the lowest hips, and this slow, is at rest.
SIT_NEAR_M, SIT_STILL_MPS = 0.05, 0.1
# A foot point may push off the floor: near it, and slower than this, is a foot that stands.
RESTING_HEIGHT_M, RESTING_SPEED_MPS = 0.03, 0.6
# Supports that a scene may need: a sole this still stands, if it is as level as 20 degrees, which a fit is
# often off; a pelvis this still rests.
FOOT_STILL_MPS, FOOT_TILT_M, REST_MPS = 0.25, 0.09, 0.25
SEAT_LEAST_M, SEAT_MAX_OF_STATURE = 0.15, 0.42
CONTACT_M = 0.005
"""Clearance of a sole in contact: that of Gärtner 2022, appendix C, for kinematics."""
NEAR_M = 0.02
"""A part of the body is near the scene."""
FLIGHT_MIN_M = 0.05
"""Who is farther than that from everything flies."""
PUSHED_N = 4.0
"""About the weight of a hand: what lies on something by its own weight touches it."""
LOADED_N = 20.0
"""A force plate under less than this is not loaded (the usual threshold of gait laboratories)."""


def still(places: Array, known: Array, interval_s: float) -> Array:
    """How surely points all stand still, (T,), by their speed: evidence does not show what they touch.

    Args:
        places: (M, T, n) m.
        known: (M, T) weights, zero where nothing is known.
        interval_s: between frames.
    """
    smooth = STILL_SMOOTH_S / interval_s
    if not known.any():
        return np.zeros(places.shape[1])
    weight = np.maximum(known, 1e-6)[..., None]
    total = gaussian_filter1d(weight, smooth, axis=1)
    smoothed = gaussian_filter1d(places * weight, smooth, axis=1) / total
    speed = np.linalg.norm(np.gradient(smoothed, interval_s, axis=1), axis=-1).max(axis=0)  # (T,)
    return np.asarray(np.exp(-((speed / STILL_MPS) ** 2)))


def touching(clearance_m: Array) -> Array:
    """How surely points touch, 0 to 1, by their signed distance from a support, any shape."""
    return np.asarray(np.exp(-((clearance_m / np.where(clearance_m > 0, TOUCH_M, SUNK_M)) ** 2)))


def held(speed_mps: Array, surely: Array) -> Array:
    """How surely points rest on something from a frame to the next, (G, T - 1).

    Args:
        speed_mps: (G, T - 1) from a frame to the next.
        surely: (G, T) how surely each touches anything.
    """
    return np.asarray(np.exp(-((speed_mps / SLOW_MPS) ** 2)) * np.minimum(surely[:, 1:], surely[:, :-1]))


def reference_contacts(height_m: Array, speed_mps: Array) -> Flags:
    """Where the foot points of a reference rest, (..., T - 1, F), by the frame they arrive at.

    A point rests within 3 cm of its 5th percentile of height at less than 0.15 m/s.

    Args:
        height_m: (..., T, F).
        speed_mps: (..., T - 1, F).
    """
    floor = np.percentile(height_m, CONTACT_PERCENTILE, axis=-2, keepdims=True)  # (..., 1, F)
    return np.asarray((height_m < floor + CONTACT_HEIGHT_M)[..., 1:, :] & (speed_mps < CONTACT_SPEED_MPS))


def rest_height_m(height_m: Array) -> float:
    """Height at which a point rests that touches often, from its heights (T,)."""
    return float(np.percentile(height_m, CONTACT_PERCENTILE))


def touches(clearance_m: Array) -> Flags:
    """Which parts of a reference touch: those within 3 cm of a support, any shape."""
    return np.asarray(clearance_m < CONTACT_HEIGHT_M)


def near(clearance_m: Array) -> Flags:
    """Which parts are within 2 cm of the scene, at rest or in passing, any shape."""
    return np.asarray(clearance_m < NEAR_M)


def on_support(clearance_m: Array) -> Flags:
    """Which soles are in contact with what is under them (Gärtner 2022, appendix C), any shape."""
    return np.asarray(clearance_m <= CONTACT_M)


def flies(clearance_m: Array) -> Flags:
    """Frames in which no part is near anything, (..., T, C) → (..., T)."""
    return np.asarray((clearance_m > FLIGHT_MIN_M).all(-1))


def stands_by(height_m: Array, rest_m: Array, speed_mps: Array) -> Flags:
    """Which foot points may push off the floor: near their height of rest, and not fast; any shape."""
    return np.asarray((height_m < rest_m + RESTING_HEIGHT_M) & (speed_mps < RESTING_SPEED_MPS))


def sits(height_m: Array, lowest_m: float, speed_mps: Array) -> Flags:
    """Frames in which hips are low and at rest, (T,)."""
    return np.asarray((height_m < lowest_m + SIT_NEAR_M) & (speed_mps < SIT_STILL_MPS))


def stands(speed_mps: Array, tilt_m: Array) -> Flags:
    """Frames in which a sole stands on whatever it is over: still and level, (T,).

    Args:
        speed_mps: (T,) of its middle.
        tilt_m: (T,) from its lowest corner to its highest.
    """
    return np.asarray((speed_mps < FOOT_STILL_MPS) & (tilt_m < FOOT_TILT_M))


def seated(over_m: Array, speed_mps: Array, stature_m: float) -> Flags:
    """Frames in which a pelvis rests, too low to stand and too high to lie on the floor, (T,)."""
    between = (over_m > SEAT_LEAST_M) & (over_m < SEAT_MAX_OF_STATURE * stature_m)
    return np.asarray(between & (speed_mps < REST_MPS))


def pushed(force_N: Array) -> Flags:
    """Which parts touch by the force of a simulation, which has no noise, any shape."""
    return np.asarray(force_N > PUSHED_N)


def loaded(force_N: Array) -> Flags:
    """Which parts the scene pushes, by the size of the force, any shape."""
    return np.asarray(force_N > LOADED_N)
