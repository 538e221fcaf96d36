"""Scores of a motion against a reference, as pure functions of arrays; docs/metrics.md explains them.

Axes: T frames, J joints, F foot points; leading axes are batches. Metres and seconds unless a name says
otherwise.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simrecon.errors import InputError
from simrecon.evidence.arrays import load
from simrecon.types import Array

TRUTH_SCHEMA = "simrecon.truth/1"
SIDES = ("left", "right")
BODY_JOINTS = tuple(
    f"{side}_{joint}" for joint in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist") for side in SIDES
)
FOOT_POINTS = ("left_heel", "right_heel", "left_toe", "right_toe")
ALIASES = {"left_foot_index": "left_toe", "right_foot_index": "right_toe"}

# Gärtner 2022, appendix C.
CONTACT_KINEMATICS_M = 0.005
CONTACT_DYNAMICS_M = -0.015
SKATE_MIN_M = 0.02
FLOAT_MAX_M = 0.02

# Reference contact: near the lowest height of the foot point in the reference, and slow there.
CONTACT_PERCENTILE = 5.0
CONTACT_HEIGHT_M = 0.03
CONTACT_SPEED_MPS = 0.15
SKATE_SPEED_MPS = 0.5
CONTACTS_MIN = 6

_TIME_TOLERANCE_S = 1e-6


@dataclass(frozen=True, eq=False)
class Truth:
    """A reference (`simrecon.truth/1`): times (T,), K names, joints (T, K, 3) in the world, z up."""

    times_s: Array
    joint_names: tuple[str, ...]
    joints_m: Array


def read_truth(path: str | os.PathLike[str]) -> Truth:
    """Read a reference. Nothing that reconstructs may call this.

    Raises:
        InputError: one line with file, key, what was found and what is valid.
    """
    arrays = load(path)
    arrays.text("schema", (TRUTH_SCHEMA,))
    times = arrays.finite("times_s", ("T",))
    if (np.diff(times) <= 0).any():
        arrays.fail("times_s", "times that do not increase", "increasing times in seconds")
    names = arrays.names("joint_names", "K")
    return Truth(times, names, arrays.finite("joints_m", ("T", "K", 3)))


def mpjpe_g(joints: Array, truth: Array) -> Array:
    """Mean distance of joints in the world, (..., T, J, 3) → (...)."""
    return np.asarray(np.linalg.norm(joints - truth, axis=-1).mean((-2, -1)))


def mpjpe_g_align1(joints: Array, truth: Array, root: Array, truth_root: Array) -> Array:
    """`mpjpe_g` after one translation that puts the roots (..., T, 3) of the first frame together.

    Gärtner 2022 reports this as MPJPE-G ("first frame translation aligned", appendix C).
    """
    return mpjpe_g(joints - root[..., :1, None, :], truth - truth_root[..., :1, None, :])


def mpjpe(joints: Array, truth: Array, root: Array, truth_root: Array) -> Array:
    """Mean distance of joints relative to the root of their frame; roots (..., T, 3) → (...)."""
    return mpjpe_g(joints - root[..., None, :], truth - truth_root[..., None, :])


def mpjpe_pa(joints: Array, truth: Array) -> Array:
    """`mpjpe_g` after the similarity transform of each frame that fits the joints best (`procrustes`)."""
    return mpjpe_g(procrustes(joints, truth), truth)


def procrustes(points: Array, target: Array) -> Array:
    """Points (..., J, 3) under the rotation, scale and translation nearest to the target in least squares.

    Umeyama 1991, eqs. 39-42: reflections are excluded.
    """
    centre, target_centre = points.mean(-2, keepdims=True), target.mean(-2, keepdims=True)
    a, b = points - centre, target - target_centre  # (..., J, 3)
    u, values, vt = np.linalg.svd(np.swapaxes(b, -1, -2) @ a)  # (..., 3, 3), (..., 3), (..., 3, 3)
    sign = np.ones_like(values)
    sign[..., 2] = np.sign(np.linalg.det(u @ vt))
    rotation = (u * sign[..., None, :]) @ vt  # (..., 3, 3)
    spread = np.square(a).sum((-2, -1))
    scale = (values * sign).sum(-1) / np.where(spread > 0, spread, 1.0)  # (...)
    return np.asarray(scale[..., None, None] * a @ np.swapaxes(rotation, -1, -2) + target_centre)


def root_error(root: Array, truth_root: Array) -> Array:
    """Mean distance of the roots, (..., T, 3) → (...)."""
    return np.asarray(np.linalg.norm(root - truth_root, axis=-1).mean(-1))


def mpjpe_2d(points_px: Array, truth_px: Array) -> Array:
    """Mean distance over the landmarks known in both, px, (..., T, J, 2) → (...); NaN without any."""
    distance = np.linalg.norm(points_px - truth_px, axis=-1)  # (..., T, J)
    known = np.isfinite(distance)
    count = known.sum((-2, -1))
    total = np.where(known, distance, 0.0).sum((-2, -1))
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def velocity(joints: Array, truth: Array, interval_s: float) -> Array:
    """Mean norm of the difference of the joints' velocity vectors, m/s; (..., T, J, 3) → (...)."""
    return mpjpe_g(np.diff(joints, axis=-3), np.diff(truth, axis=-3)) / interval_s


def velocity_gartner(joints: Array, truth: Array, interval_s: float) -> Array:
    """Mean absolute difference of the joints' speeds, m/s; (..., T, J, 3) → (...).

    Gärtner 2022 eq. 10, with a mean over the joints where it prints a sum (docs/metrics.md says why).
    The alignment of the first frame that the paper asks for cancels in the differences.
    """
    speed, truth_speed = (  # (..., T-1, J)
        np.linalg.norm(np.diff(x, axis=-3), axis=-1) / interval_s for x in (joints, truth)
    )
    return np.asarray(np.abs(speed - truth_speed).mean((-2, -1)))


def acceleration(joints: Array, truth: Array, interval_s: float) -> Array:
    """Mean norm of the difference of the joints' acceleration vectors, m/s²; (..., T, J, 3) → (...)."""
    return mpjpe_g(np.diff(joints, 2, axis=-3), np.diff(truth, 2, axis=-3)) / interval_s**2


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


def footskate_pct(feet: Array, clearance: Array, contact: float = CONTACT_KINEMATICS_M) -> Array:
    """Share of steps between frames in which a foot in contact moves more than 2 cm, in percent.

    Gärtner 2022, appendix C; a foot is in contact where its clearance is at most `contact` in both frames.
    The paper counts mesh vertices; this takes the lowest point of the foot's primitive.

    Args:
        feet: (..., T, F, 3) foot joints.
        clearance: (..., T, F) signed height of the lowest point of each foot over its support.
        contact: `CONTACT_KINEMATICS_M` for primitives, or `CONTACT_DYNAMICS_M` for the mesh around simulated
            boxes.

    Returns:
        (...) percent of T - 1.
    """
    held = clearance <= contact  # (..., T, F)
    held = held[..., 1:, :] & held[..., :-1, :]
    moved = np.linalg.norm(np.diff(feet, axis=-3), axis=-1) > SKATE_MIN_M  # (..., T-1, F)
    return np.asarray(100.0 * (held & moved).any(-1).mean(-1))


def float_pct(clearance: Array, contact: float = CONTACT_KINEMATICS_M) -> Array:
    """Share of frames in which a foot is not in contact but within 2 cm of its support, in percent.

    Gärtner 2022, appendix C; arguments as in `footskate_pct`, (..., T, F) → (...).
    """
    floating = (clearance > contact) & (clearance < FLOAT_MAX_M)  # (..., T, F)
    return np.asarray(100.0 * floating.any(-1).mean(-1))


def penetration(lowest: Array) -> tuple[Array, Array]:
    """Mean and greatest depth of the body's lowest point below the floor, (..., T) → (...), (...)."""
    depth = np.maximum(0.0, -lowest)
    return np.asarray(depth.mean(-1)), np.asarray(depth.max(-1))


def reference_contacts(truth_feet: Array, interval_s: float) -> NDArray[np.bool_]:
    """Where the reference's foot points rest, (..., T, F, 3) → (..., T - 1, F), by the frame they arrive at.

    A point rests within 3 cm of its 5th percentile of height at less than 0.15 m/s.
    """
    height = truth_feet[..., 2]  # (..., T, F)
    floor = np.percentile(height, CONTACT_PERCENTILE, axis=-2, keepdims=True)  # (..., 1, F)
    speed = np.linalg.norm(np.diff(truth_feet, axis=-3), axis=-1) / interval_s  # (..., T-1, F)
    resting = (height < floor + CONTACT_HEIGHT_M)[..., 1:, :] & (speed < CONTACT_SPEED_MPS)
    return np.asarray(resting)


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


def evaluate(
    motion_times_s: Array,
    motion_names: Sequence[str],
    motion_joints_m: Array,
    truth_times_s: Array,
    truth_names: Sequence[str],
    truth_joints_m: Array,
) -> dict[str, float]:
    """All scores that joints allow; both are taken at the reference's times that the motion covers.

    Args:
        motion_times_s: (T,) increasing.
        motion_names: K names.
        motion_joints_m: (T, K, 3) in the world.
        truth_times_s: (S,) increasing.
        truth_names: L names, in any order.
        truth_joints_m: (S, L, 3) in the world.

    Returns:
        By name with unit: `covered` (share of the reference's frames), `mpjpe_g_mm`, `mpjpe_mm`,
        `mpjpe_pa_mm`, `mpjpe_g_align1_mm`, `root_mm`, `velocity_mps`, `velocity_gartner_mps`, `accel_mps2`
        over `BODY_JOINTS`, with the middle of the hips as root; then `foot_metrics` over the `FOOT_POINTS`
        that both have.

    Raises:
        InputError: joints of `BODY_JOINTS` are missing, or fewer than three frames are covered.
    """
    names, truth_names = (tuple(ALIASES.get(n, n) for n in given) for given in (motion_names, truth_names))
    for whose, given in (("motion", names), ("reference", truth_names)):
        if missing := [joint for joint in BODY_JOINTS if joint not in given]:
            valid = f"all of {', '.join(BODY_JOINTS)}"
            raise InputError(f"joint_names of the {whose}: found no {', '.join(missing)}; valid: {valid}")
    start, end = motion_times_s[0] - _TIME_TOLERANCE_S, motion_times_s[-1] + _TIME_TOLERANCE_S
    times = truth_times_s[(truth_times_s >= start) & (truth_times_s <= end)]
    if len(times) < 3:
        found = f"{len(times)} frames of the reference from {start:.3f} to {end:.3f} s"
        raise InputError(f"times_s: found {found}, which the motion covers; valid: three or more")
    used = [*BODY_JOINTS, *(f for f in FOOT_POINTS if f in names and f in truth_names)]
    joints = _at(times, motion_times_s, motion_joints_m[:, [names.index(n) for n in used]])
    truth = _at(times, truth_times_s, truth_joints_m[:, [truth_names.index(n) for n in used]])
    interval = float(np.median(np.diff(times)))
    scores = {"covered": len(times) / len(truth_times_s), **_body_scores(joints, truth, interval)}
    feet = slice(len(BODY_JOINTS), None)
    return scores | foot_metrics(joints[:, feet], truth[:, feet], interval)


def table(rows: Mapping[str, Mapping[str, float]]) -> str:
    """Scores as aligned text, one row per clip and one column per score; `-` where a clip lacks one."""
    columns = list(dict.fromkeys(column for row in rows.values() for column in row))
    body = [[name, *(f"{row[c]:.4g}" if c in row else "-" for c in columns)] for name, row in rows.items()]
    lines = [["", *columns], *body]
    first, *others = (max(map(len, cells)) for cells in zip(*lines, strict=True))
    return "\n".join(
        "  ".join([name.ljust(first), *(cell.rjust(n) for cell, n in zip(cells, others, strict=True))])
        for name, *cells in lines
    )


def _body_scores(joints: Array, truth: Array, interval_s: float) -> dict[str, float]:
    body = slice(len(BODY_JOINTS))
    a, b = joints[:, body], truth[:, body]  # (T, 12, 3)
    root, truth_root = a[:, :2].mean(1), b[:, :2].mean(1)  # (T, 3) between the hips, which come first
    scores = {
        "mpjpe_g_mm": 1e3 * mpjpe_g(a, b),
        "mpjpe_mm": 1e3 * mpjpe(a, b, root, truth_root),
        "mpjpe_pa_mm": 1e3 * mpjpe_pa(a, b),
        "mpjpe_g_align1_mm": 1e3 * mpjpe_g_align1(a, b, root, truth_root),
        "root_mm": 1e3 * root_error(root, truth_root),
        "velocity_mps": velocity(a, b, interval_s),
        "velocity_gartner_mps": velocity_gartner(a, b, interval_s),
        "accel_mps2": acceleration(a, b, interval_s),
    }
    return {name: float(score) for name, score in scores.items()}


def _at(times_s: Array, given_times_s: Array, joints: Array) -> Array:
    """Linear interpolation of (T, J, 3) to other times (N,) → (N, J, 3)."""
    after = np.clip(np.searchsorted(given_times_s, times_s), 1, len(given_times_s) - 1)
    before = after - 1
    fraction = (times_s - given_times_s[before]) / (given_times_s[after] - given_times_s[before])  # (N,)
    weight = np.clip(fraction, 0.0, 1.0)[:, None, None]
    return np.asarray((1 - weight) * joints[before] + weight * joints[after])
