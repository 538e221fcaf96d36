"""Contact of feet and of the whole body, as pure functions of arrays (docs/metrics.md).

Axes: T frames, F foot points, C body parts; leading axes are batches. Clearance is the signed height or
distance of the lowest point over what supports it, negative = sunk in. Frames with NaN don't count.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simrecon.metrics.pose import mean_known
from simrecon.types import Array

Flags = NDArray[np.bool_]

# Gärtner 2022, appendix C.
CONTACT_KINEMATICS_M = 0.005
CONTACT_DYNAMICS_M = -0.015
CONTACT_VERTICES = 10
SKATE_MIN_M = 0.02
FLOAT_MAX_M = 0.02

# Rempe 2020, section 4.3.
FLOATING_MIN_M = 0.03
PENETRATION_MIN_M = 0.03

# WHAM (Shin 2024): a foot of the reference rests below 1 cm a frame, at 30 frames a second.
RESTING_STEP_M = 0.01

# Reference contact: near the lowest height of the foot point in the reference, and slow there.
CONTACT_PERCENTILE = 5.0
CONTACT_HEIGHT_M = 0.03
CONTACT_SPEED_MPS = 0.15
SKATE_SPEED_MPS = 0.5
CONTACTS_MIN = 6

PENETRATION_TOLERANCE_M = 0.005
"""Depth from which a frame counts as penetrating: soft contact sinks in by a few millimetres."""


def box_clearance(position: Array, rotation: Array, half_size: Array, support: Array | float = 0.0) -> Array:
    """Signed height of a box's lowest corner over its support; negative = sunk in.

    Args:
        position: (..., 3) centre in the world.
        rotation: (..., 3, 3) box to world.
        half_size: (3,) or (..., 3).
        support: height of the ground, or of what is under the box, (...).
    """
    reach = (np.abs(rotation[..., 2, :]) * half_size).sum(-1)  # (...)
    return np.asarray(position[..., 2] - reach - support)


def vertex_clearance(height: Array, vertices: int = CONTACT_VERTICES) -> Array:
    """Clearance of a foot's mesh for `footskate_pct` and `float_pct`: that of its tenth lowest vertex.

    Gärtner 2022, appendix C: "at least N = 10 vertices of a foot mesh being in contact".

    Args:
        height: (..., V) signed height of a foot's vertices over their support, V at least `vertices`.
        vertices: that must touch.

    Returns:
        (...) at most d where that many vertices are at most d.
    """
    return np.asarray(np.partition(height, vertices - 1, axis=-1)[..., vertices - 1])


def steps(points: Array) -> Array:
    """Distance that each point moves between frames, (..., T, F, 3) → (..., T - 1, F)."""
    return np.asarray(np.linalg.norm(np.diff(points, axis=-3), axis=-1))


def both(flags: Flags) -> Flags:
    """True for steps between frames that both hold, (..., T, F) → (..., T - 1, F)."""
    return np.asarray(flags[..., 1:, :] & flags[..., :-1, :])


def footskate_steps(feet: Array, clearance: Array, contact: float = CONTACT_KINEMATICS_M) -> Flags:
    """Steps in which a foot in contact moves more than 2 cm, (..., T - 1); see `footskate_pct`."""
    return np.asarray((both(clearance <= contact) & (steps(feet) > SKATE_MIN_M)).any(-1))


def footskate_pct(feet: Array, clearance: Array, contact: float = CONTACT_KINEMATICS_M) -> Array:
    """Footskate: share of steps between frames in which a foot in contact moves more than 2 cm, in percent.

    Gärtner 2022, appendix C; a foot is in contact where its clearance is at most `contact` in both frames.
    The paper counts mesh vertices (`vertex_clearance`); with primitives, the clearance is that of the lowest
    point. It depends on the frame rate: 2 cm a frame are 0.5 m/s at the paper's 25 frames a second.

    With the ankle as the foot's joint, as printed, a foot that rolls over its toe counts as skating. With
    points of the sole, each with its own clearance, only what touches must stay (docs/metrics.md).

    Args:
        feet: (..., T, F, 3) foot joints, or points of the sole.
        clearance: (..., T, F) signed height of the lowest point of each foot, or of each point, over its
            support.
        contact: `CONTACT_KINEMATICS_M` for primitives, or `CONTACT_DYNAMICS_M` for the mesh around simulated
            boxes.

    Returns:
        (...) percent of T - 1.
    """
    return np.asarray(100.0 * footskate_steps(feet, clearance, contact).mean(-1))


def footskate_annotated_pct(feet: Array, contacts: Flags) -> Array:
    """The annotation form of `footskate_pct`: contact is given, (..., T, F, 3), (..., T, F) → (...).

    Rempe 2020's labels in Gärtner 2022's count of frames.
    """
    return np.asarray(100.0 * (both(contacts) & (steps(feet) > SKATE_MIN_M)).any(-1).mean(-1))


def float_frames(clearance: Array, contact: float = CONTACT_KINEMATICS_M) -> Flags:
    """Frames in which a foot hovers, (..., T, F) → (..., T); see `float_pct`."""
    return np.asarray(((clearance > contact) & (clearance < FLOAT_MAX_M)).any(-1))


def float_pct(clearance: Array, contact: float = CONTACT_KINEMATICS_M) -> Array:
    """Float: share of frames in which a foot is not in contact but within 2 cm of its support, in percent.

    Gärtner 2022, appendix C; arguments as in `footskate_pct`, (..., T, F) → (...). A foot that swings low
    counts as well: `float_body_frames` leaves it out.
    """
    return np.asarray(100.0 * float_frames(clearance, contact).mean(-1))


def float_body_frames(feet: Array, parts: Array, contact: float = CONTACT_KINEMATICS_M) -> Flags:
    """Frames in which the whole body floats: a foot is within 2 cm of its support, and nothing touches.

    The artefact that Gärtner 2022, appendix C, means its float to show, "reconstructions floating above the
    ground while not penalizing correctly reconstructed motion of e.g. jumps".

    Args:
        feet: (..., T, F) clearance of the feet.
        parts: (..., T, C) clearance of all parts of the body, feet too.
        contact: clearance from which nothing touches.

    Returns:
        (..., T).
    """
    return np.asarray((parts > contact).all(-1) & (feet < FLOAT_MAX_M).any(-1))


def float_annotated_pct(clearance: Array, contacts: Flags) -> Array:
    """The annotation form of `float_pct`: share of frames in which a foot that should rest hovers, percent.

    A foot hovers from `CONTACT_KINEMATICS_M` on, however high. (..., T, F), (..., T, F) → (...).
    """
    return np.asarray(100.0 * ((clearance > CONTACT_KINEMATICS_M) & contacts).any(-1).mean(-1))


def floating_rempe_pct(height: Array, contacts: Flags) -> float:
    """Floating: share of foot points more than 3 cm off the ground of those that should touch it, in percent.

    Rempe 2020, section 4.3, over heels and toes; NaN without contacts. The paper doesn't say whether points
    that should not touch belong to the denominator; here they don't.

    Args:
        height: (T, F) over the ground, less the height at which the point rests (`resting_height`).
        contacts: (T, F) of the reference.
    """
    return 100.0 * _share(height > FLOATING_MIN_M, contacts)


def penetration_rempe_pct(height: Array) -> float:
    """Penetration: share of foot points more than 3 cm under the ground, at any time, in percent.

    Rempe 2020, section 4.3; `height` as in `floating_rempe_pct`.
    """
    return 100.0 * _share(height < -PENETRATION_MIN_M, np.isfinite(height))


def skate_rempe_pct(feet: Array, contacts: Flags) -> float:
    """Skate: share of foot points that move more than 2 cm a frame of those in contact, in percent.

    Rempe 2020, section 4.3, at 30 frames a second; a step counts if the point is in contact at both its ends.

    Args:
        feet: (T, F, 3).
        contacts: (T, F) of the reference.
    """
    return 100.0 * _share(steps(feet) > SKATE_MIN_M, both(contacts))


def skate_wham_mm(feet: Array, truth_feet: Array, resting_m: float = RESTING_STEP_M) -> float:
    """Foot sliding: mean step of foot points while the reference's move less than 1 cm, mm a frame.

    WHAM (Shin 2024) and GVHMR (Shen 2024) take two vertices of each foot of SMPL, at 30 frames a second;
    these are heels and toes. NaN if the reference never rests.

    Args:
        feet: (T, F, 3).
        truth_feet: (T, F, 3).
        resting_m: step of the reference below which it rests.
    """
    resting = steps(truth_feet) < resting_m
    return 1e3 * float(steps(feet)[resting].mean()) if resting.any() else float("nan")


def penetration(lowest: Array) -> tuple[Array, Array]:
    """Mean and greatest depth of the body's lowest point below the floor, (..., T) → (...), (...)."""
    depth = np.maximum(0.0, -lowest)
    return np.asarray(depth.mean(-1)), np.asarray(depth.max(-1))


def penetration_pct(clearance: Array, tolerance_m: float = PENETRATION_TOLERANCE_M) -> Array:
    """Share of frames with any part of the body deeper in than a tolerance, percent, (..., T, C) → (...).

    Over the whole body, where the papers look at the feet.
    """
    return np.asarray(100.0 * (clearance < -tolerance_m).any(-1).mean(-1))


def resting_height(truth_feet: Array) -> Array:
    """Height at which a foot point rests: 5th percentile in the reference, (..., T, F, 3) → (..., F)."""
    return np.asarray(np.percentile(truth_feet[..., 2], CONTACT_PERCENTILE, axis=-2))


def reference_contacts(truth_feet: Array, interval_s: float) -> Flags:
    """Where the reference's foot points rest, (..., T, F, 3) → (..., T - 1, F), by the frame they arrive at.

    A point rests within 3 cm of its 5th percentile of height at less than 0.15 m/s.
    """
    height = truth_feet[..., 2]  # (..., T, F)
    floor = np.percentile(height, CONTACT_PERCENTILE, axis=-2, keepdims=True)  # (..., 1, F)
    speed = np.linalg.norm(np.diff(truth_feet, axis=-3), axis=-1) / interval_s  # (..., T-1, F)
    resting = (height < floor + CONTACT_HEIGHT_M)[..., 1:, :] & (speed < CONTACT_SPEED_MPS)
    return np.asarray(resting)


def frame_contacts(step_contacts: Flags) -> Flags:
    """Contacts by frame from `reference_contacts`: the first frame takes those of the second.

    (..., T - 1, F) → (..., T, F).
    """
    return np.concatenate((step_contacts[..., :1, :], step_contacts), axis=-2)


def contact_f1(found: Flags, contacts: Flags) -> Array:
    """F1 score of contact of each part, (..., T, C), (..., T, C) → (..., C); NaN where neither has contact.

    2 TP / (2 TP + FP + FN) over frames; Rempe 2020 table 1 gives it for the feet.
    """
    both_have = (found & contacts).sum(-2)
    one_has = (found ^ contacts).sum(-2)
    count = 2 * both_have + one_has
    return np.asarray(np.where(count > 0, 2 * both_have / np.maximum(count, 1), np.nan))


def foot_metrics(feet: Array, truth_feet: Array, interval_s: float) -> dict[str, float]:
    """Skating of foot points where the reference's rest (`reference_contacts`).

    Args:
        feet: (T, F, 3) foot points.
        truth_feet: (T, F, 3) of the reference.
        interval_s: between frames.

    Returns:
        By name: `foot_contact_frames` their number; `footskate_pct` share faster than 0.5 m/s;
        `foot_slide_mps`, `foot_slide_truth_mps` mean speeds; `foot_height_err_mm` mean absolute difference of
        height. Empty with fewer than six contacts.
    """
    contact = reference_contacts(truth_feet, interval_s)  # (T-1, F)
    if contact.sum() < CONTACTS_MIN:
        return {}
    speed, truth_speed = (
        np.linalg.norm(np.diff(x, axis=0), axis=-1)[contact] / interval_s for x in (feet, truth_feet)
    )
    height_error = np.abs(feet[1:, :, 2] - truth_feet[1:, :, 2])[contact]
    return {
        "foot_contact_frames": float(contact.sum()),
        "footskate_pct": 100.0 * float((speed > SKATE_SPEED_MPS).mean()),
        "foot_slide_mps": float(speed.mean()),
        "foot_slide_truth_mps": float(truth_speed.mean()),
        "foot_height_err_mm": 1e3 * float(height_error.mean()),
    }


def _share(hits: Flags, counted: Flags) -> float:
    return float(mean_known(np.where(counted, hits, np.nan), (-2, -1)))
