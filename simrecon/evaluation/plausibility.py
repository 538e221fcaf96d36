"""Scores of contact, jitter and implied force that every motion has, the reference too."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simrecon.evaluation import pushes
from simrecon.evaluation.comparison import Comparison, Track
from simrecon.metrics import anthropometry, bones, clearance, contact, dynamics, feet, pose, smoothness, touch
from simrecon.metrics.rates import H36M_HZ, PAPER_HZ, at, every
from simrecon.metrics.statistics import Scores, Series, of_frames
from simrecon.metrics.truth import BODY_JOINTS, SIDES
from simrecon.types import Array


def plausibility(motion: Track, on: Comparison) -> Scores:
    """Scores of contact, jitter and implied force that every motion has, the reference too.

    Args:
        motion: with all of `BODY_JOINTS`.
        on: what the motions are compared on; its reference says only where feet rest, at which height, and
            where nothing touches.
    """
    body = motion.at(on.slow_s, BODY_JOINTS)  # (S, 12, 3)
    series = {"jitter_10mps3": of_frames(smoothness.jerks(body, PAPER_HZ), scale=0.1)}
    return (
        Scores(series | _threshold(motion, on))
        | _implied(motion, on)
        | _annotated(motion, on)
        | _whole_body(motion, on)
    )


def _whole_body(motion: Track, on: Comparison) -> Scores:
    """Penetration and contact of the capsules; none without all foot points, or if a joint is unknown."""
    if len(on.feet_of(motion)) < len(on.feet):
        return Scores()
    names = (*BODY_JOINTS, *on.feet)
    joints = motion.at(on.times_s, names)
    if not np.isfinite(joints).all():
        return Scores()
    distance = bones.bone_clearance(on.parts_of(motion), names, joints, on.scene)  # (T, C)
    depth = clearance.penetration_depths(distance)
    touching = bones.touching(on.parts, names, joints, distance, on.interval_s)
    f1 = contact.contact_f1(touching, on.touching)
    series = {
        "body_penetration_mean_mm": of_frames(depth, scale=1e3),
        "body_penetration_pct": of_frames(clearance.penetrating_frames(distance), scale=100.0),
    }
    numbers = {"body_penetration_max_mm": 1e3 * float(depth.max())}
    numbers |= {f"f1_{part}": float(score) for part, score in zip(on.parts.names, f1, strict=True)}
    numbers["contact_f1"] = float(pose.mean_known(f1, (0,)))
    numbers |= touch.scores(touch.near(distance, on.parts.names), on.near)
    numbers |= pushes.true_contact_f1(touching, on)
    return Scores(series, numbers)


def _annotated(motion: Track, on: Comparison) -> Scores:
    """Rempe 2020 and WHAM on heels and toes, and Gärtner 2022's counts with annotations."""
    if not on.has_feet(motion):
        return Scores()
    points, truth = motion.at(on.slow_s, on.feet), on.truth.at(on.slow_s, on.feet)  # (S, F, 3)
    height = on.height(motion, points)  # (S, F)
    labelled = _lowest(-on.contacts.astype(np.float64), on.feet) < 0  # (S, 2) heel or toe rests
    hovers = feet.float_annotated_frames(_lowest(height, on.feet), labelled)
    skates = feet.footskate_annotated_steps(points, on.contacts)
    return Scores(
        {
            "footskate_annotated_pct": of_frames(skates, scale=100.0),
            "float_annotated_pct": of_frames(hovers, scale=100.0),
            "floating_rempe_pct": of_frames(feet.floating_points(height, on.contacts), scale=100.0),
            "penetration_rempe_pct": of_frames(feet.penetrating_points(height), scale=100.0),
            "skate_rempe_pct": of_frames(feet.skating_points(points, on.contacts), scale=100.0),
            "skate_wham_mm": of_frames(feet.resting_steps(points, truth), scale=1e3),
        }
    )


def _threshold(motion: Track, on: Comparison) -> dict[str, Series]:
    """Gärtner 2022's footskate and float of heels and toes at 25 frames a second, without annotations."""
    if not on.has_feet(motion):
        return {}
    points = motion.at(every(on.times_s, H36M_HZ), on.feet)  # (S, F, 3)
    if not np.isfinite(points).all():
        return {}
    height = on.height(motion, points)  # (S, F)
    return {
        "footskate_points_pct": of_frames(feet.footskate_steps(points, height), scale=100.0),
        "float_points_pct": of_frames(feet.float_frames(_lowest(height, on.feet)), scale=100.0),
    }


def _lowest(height: Array, points: Sequence[str]) -> Array:
    """The lower of heel and toe of each foot that has one, (S, F) → (S, 2)."""
    sides = [[k for k, point in enumerate(points) if point.startswith(side)] for side in SIDES]
    return np.stack([height[:, columns].min(-1) for columns in sides if columns], axis=-1)


def _implied(motion: Track, on: Comparison) -> Scores:
    """The force that the motion asks for (Rempe 2020), at 30 frames a second; none if a joint is unknown."""
    joints = motion.at(on.slow_s, BODY_JOINTS)
    if not np.isfinite(joints).all():
        return Scores()
    com = anthropometry.centre_of_mass(BODY_JOINTS, joints)
    norm = dynamics.grf_norm_pct(dynamics.implied_grf(com, 1.0, 1 / PAPER_HZ), 1.0)  # (S-2,)
    flight = at(on.slow_s[1:-1], on.times_s, on.flight.astype(np.float64)) > 0.5
    numbers = {
        "implied_grf_mean_pct": float(norm.mean()),
        "implied_grf_max_pct": float(norm.max()),
        "implied_grf_ballistic_pct": dynamics.ballistic_grf_pct(norm, flight),
    }
    return Scores({}, numbers)
