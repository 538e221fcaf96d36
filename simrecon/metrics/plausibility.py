"""Scores of contact, jitter and implied force that every motion has, the reference too."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simrecon.metrics import bodies, contact, dynamics, pose, touch
from simrecon.metrics.joints import H36M_HZ, PAPER_HZ, Clip, Scores, Track, every
from simrecon.metrics.statistics import Series, of_frames
from simrecon.metrics.truth import BODY_JOINTS, SIDES, at
from simrecon.types import Array


def plausibility(motion: Track, on: Clip) -> Scores:
    """Scores of contact, jitter and implied force that every motion has, the reference too.

    Args:
        motion: with all of `BODY_JOINTS`.
        on: the clip; its reference says only where feet rest, at which height, and where nothing touches.
    """
    body = motion.at(on.slow_s, BODY_JOINTS)  # (S, 12, 3)
    third = np.linalg.norm(np.diff(body, 3, axis=0), axis=-1) * PAPER_HZ**3
    series = {"jitter_10mps3": of_frames(third, scale=0.1)}
    found = Scores(series | _threshold(motion, on)) | _implied(motion, on) | _rempe(motion, on)
    if not set(on.feet) <= set(motion.names):
        return found
    names = (*BODY_JOINTS, *on.feet)
    joints = motion.at(on.times_s, names)
    if not np.isfinite(joints).all():
        return found
    clearance = bodies.bone_clearance(on.parts_of(motion), names, joints, on.scene)  # (T, C)
    deep = np.asarray((clearance < -contact.PENETRATION_TOLERANCE_M).any(-1))
    depth = np.maximum(-clearance, 0.0).max(-1)
    touching = bodies.touching(on.parts, names, joints, clearance, on.interval_s)
    f1 = contact.contact_f1(touching, on.touching)
    series = {
        "body_penetration_mean_mm": of_frames(depth, scale=1e3),
        "body_penetration_pct": of_frames(deep.astype(np.float64), scale=100.0),
    }
    numbers = {"body_penetration_max_mm": 1e3 * float(depth.max())}
    numbers |= {f"f1_{part}": float(score) for part, score in zip(on.parts.names, f1, strict=True)}
    numbers["contact_f1"] = float(pose.mean_known(f1, (0,)))
    numbers |= touch.scores(touch.near(clearance, on.parts.names), on.near)
    return found | Scores(series, numbers)


def _rempe(motion: Track, on: Clip) -> Scores:
    """Rempe 2020 and WHAM on heels and toes, and Gärtner 2022's counts with annotations."""
    feet = [point for point in on.feet if point in motion.names]
    if len(feet) < len(on.feet) or not feet:
        return Scores()
    points, truth = motion.at(on.slow_s, feet), on.truth.at(on.slow_s, feet)  # (S, F, 3)
    height = on.height(motion, points)  # (S, F)
    step, resting = contact.steps(points), contact.both(on.contacts)
    known, moves = np.isfinite(height), np.where(np.isfinite(step), step > contact.SKATE_MIN_M, np.nan)
    still = contact.steps(truth) < contact.RESTING_STEP_M
    annotated = np.where(np.isfinite(step), resting & (step > contact.SKATE_MIN_M), np.nan)
    lowest = _lowest(height, feet)  # (S, 2)
    labelled = _lowest(-on.contacts.astype(np.float64), feet) < 0  # (S, 2) heel or toe rests
    hovers = np.where(np.isfinite(lowest), labelled & (lowest > contact.CONTACT_KINEMATICS_M), np.nan)
    return Scores(
        {
            "footskate_annotated_pct": of_frames(annotated.max(-1), scale=100.0),
            "float_annotated_pct": of_frames(hovers.max(-1), scale=100.0),
            "floating_rempe_pct": of_frames(
                1.0 * (height > contact.FLOATING_MIN_M), on.contacts & known, scale=100.0
            ),
            "penetration_rempe_pct": of_frames(
                1.0 * (height < -contact.PENETRATION_MIN_M), known, scale=100.0
            ),
            "skate_rempe_pct": of_frames(moves, resting, scale=100.0),
            "skate_wham_mm": of_frames(step, still, scale=1e3),
        }
    )


def _threshold(motion: Track, on: Clip) -> dict[str, Series]:
    """Gärtner 2022's footskate and float of heels and toes at 25 frames a second, without annotations."""
    feet = [point for point in on.feet if point in motion.names]
    if len(feet) < len(on.feet) or not feet:
        return {}
    points = motion.at(every(on.times_s, H36M_HZ), feet)  # (S, F, 3)
    if not np.isfinite(points).all():
        return {}
    height = on.height(motion, points)  # (S, F)
    floats = contact.float_frames(_lowest(height, feet))
    return {
        "footskate_points_pct": of_frames(1.0 * contact.footskate_steps(points, height), scale=100.0),
        "float_points_pct": of_frames(1.0 * floats, scale=100.0),
    }


def _lowest(height: Array, feet: Sequence[str]) -> Array:
    """The lower of heel and toe of each foot that has one, (S, F) → (S, 2)."""
    sides = [[k for k, point in enumerate(feet) if point.startswith(side)] for side in SIDES]
    return np.stack([height[:, columns].min(-1) for columns in sides if columns], axis=-1)


def _implied(motion: Track, on: Clip) -> Scores:
    """The force that the motion asks for (Rempe 2020), at 30 frames a second; none if a joint is unknown."""
    joints = motion.at(on.slow_s, BODY_JOINTS)
    if not np.isfinite(joints).all():
        return Scores()
    force = dynamics.implied_grf(bodies.centre_of_mass(BODY_JOINTS, joints), 1.0, 1 / PAPER_HZ)  # (S-2, 3)
    flight = at(on.slow_s[1:-1], on.times_s, on.flight.astype(np.float64)) > 0.5
    numbers = {
        "implied_grf_mean_pct": float(dynamics.mean_grf_pct(force, 1.0)),
        "implied_grf_max_pct": float(dynamics.max_grf_pct(force, 1.0)),
        "implied_grf_ballistic_pct": dynamics.ballistic_grf_pct(force, flight, 1.0),
    }
    return Scores({}, numbers)
