"""Feet that skate, float or sink in, by frame, as pure functions of arrays (docs/metrics.md).

The score of each is its mean (`statistics.of_frames`), in percent where it flags frames or points. Axes: T
frames, F foot points, C body parts; leading axes are batches. Clearance is the signed height of a point over
its support, negative = sunk in; height is that over where the point rests. Flags that may be unknown are 1,
0, or NaN where they don't count.
"""

from __future__ import annotations

import numpy as np

from simrecon.contact import rules
from simrecon.metrics.contact import both
from simrecon.metrics.smoothness import steps
from simrecon.types import Array, Flags

# Gärtner 2022, appendix C; contact is that of `contact.rules.on_support`.
SKATE_MIN_M = 0.02
FLOAT_MAX_M = 0.02

# Rempe 2020, section 4.3.
FLOATING_MIN_M = 0.03
PENETRATION_MIN_M = 0.03

# WHAM (Shin 2024): a foot of the reference rests below 1 cm a frame, at 30 frames a second.
RESTING_STEP_M = 0.01

SKATE_SPEED_MPS = 0.5
"""From which a foot skates at any frame rate: 2 cm a frame at Gärtner's 25 frames a second."""


def footskate_steps(feet: Array, clearance: Array) -> Flags:
    """Footskate: steps between frames in which a foot in contact moves more than 2 cm, (..., T - 1).

    Gärtner 2022, appendix C; a foot is in contact where its clearance is at most 5 mm in both frames. The
    paper counts vertices of a mesh; with primitives, the clearance is that of the lowest point. It depends on
    the frame rate: 2 cm a frame are 0.5 m/s at the paper's 25 frames a second.

    With the ankle as the foot's joint, as printed, a foot that rolls over its toe counts as skating. With
    points of the sole, each with its own clearance, only what touches must stay (docs/metrics.md).

    Args:
        feet: (..., T, F, 3) foot joints, or points of the sole.
        clearance: (..., T, F) of the lowest point of each foot, or of each point.
    """
    return np.asarray((both(rules.on_support(clearance)) & (steps(feet) > SKATE_MIN_M)).any(-1))


def footskate_annotated_steps(feet: Array, contacts: Flags) -> Array:
    """The annotation form of `footskate_steps`: contact is known, (..., T, F, 3), (..., T, F) → (..., T - 1).

    Rempe 2020's labels in Gärtner 2022's count of frames. NaN where a point is unknown.
    """
    step = steps(feet)
    return np.asarray(_known(step, both(contacts) & (step > SKATE_MIN_M)).max(-1))


def float_frames(clearance: Array) -> Flags:
    """Float: frames in which a foot is not in contact but within 2 cm of its support, (..., T, F) → (..., T).

    Gärtner 2022, appendix C. A foot that swings low counts as well: `float_body_frames` leaves it out.
    """
    return np.asarray((~rules.on_support(clearance) & (clearance < FLOAT_MAX_M)).any(-1))


def float_body_frames(feet: Array, parts: Array) -> Flags:
    """Frames in which the whole body floats: a foot is within 2 cm of its support, and nothing touches.

    The artefact that Gärtner 2022, appendix C, means its float to show, "reconstructions floating above the
    ground while not penalizing correctly reconstructed motion of e.g. jumps".

    Args:
        feet: (..., T, F) clearance of the feet.
        parts: (..., T, C) clearance of all parts of the body, feet too.

    Returns:
        (..., T).
    """
    return np.asarray((parts > rules.CONTACT_M).all(-1) & (feet < FLOAT_MAX_M).any(-1))


def float_annotated_frames(height: Array, contacts: Flags) -> Array:
    """The annotation form of `float_frames`: frames in which a foot that should rest hovers, (..., T).

    A foot hovers from 5 mm on, however high. (..., T, F), (..., T, F) → (..., T); NaN where one is unknown.
    """
    return np.asarray(_known(height, contacts & (height > rules.CONTACT_M)).max(-1))


def floating_points(height: Array, contacts: Flags) -> Array:
    """Floating: foot points more than 3 cm off the ground of those that should touch it, (..., T, F).

    Rempe 2020, section 4.3, over heels and toes. The paper doesn't say whether points that should not touch
    belong to the denominator; here they are NaN.

    Args:
        height: (..., T, F) over where the point rests.
        contacts: (..., T, F) of the reference.
    """
    return np.where(contacts, _known(height, height > FLOATING_MIN_M), np.nan)


def penetrating_points(height: Array) -> Array:
    """Penetration: foot points more than 3 cm under the ground, at any time, (..., T, F).

    Rempe 2020, section 4.3; `height` as in `floating_points`.
    """
    return _known(height, height < -PENETRATION_MIN_M)


def skating_points(feet: Array, contacts: Flags) -> Array:
    """Skate: foot points that move more than 2 cm a frame of those in contact, (..., T - 1, F).

    Rempe 2020, section 4.3, at 30 frames a second; a step counts if the point is in contact at both its ends.

    Args:
        feet: (..., T, F, 3).
        contacts: (..., T, F) of the reference.
    """
    step = steps(feet)
    return np.where(both(contacts), _known(step, step > SKATE_MIN_M), np.nan)


def resting_steps(feet: Array, truth_feet: Array) -> Array:
    """Foot sliding: steps of foot points where the reference's are below 1 cm, m a frame, (..., T - 1, F).

    WHAM (Shin 2024) and GVHMR (Shen 2024) take two vertices of each foot of SMPL, at 30 frames a second;
    these are heels and toes. NaN where the reference moves.
    """
    return np.where(steps(truth_feet) < RESTING_STEP_M, steps(feet), np.nan)


def fast_steps(feet: Array, interval_s: float) -> Array:
    """Footskate at any rate: steps of foot points faster than 0.5 m/s, (..., T, F, 3) → (..., T - 1, F)."""
    speed = steps(feet) / interval_s
    return _known(speed, speed > SKATE_SPEED_MPS)


def _known(values: Array, flags: Flags) -> Array:
    """The flags as 1 and 0, NaN where the value is not known."""
    return np.where(np.isfinite(values), flags, np.nan)
