"""Errors of a motion against the reference: position, velocity and feet; docs/metrics.md defines each."""

from __future__ import annotations

import numpy as np

from simrecon.evaluation.comparison import Comparison, Track
from simrecon.metrics import contact, feet, pose, smoothness
from simrecon.metrics.rates import H36M_HZ, every
from simrecon.metrics.statistics import Scores, Series, of_frames
from simrecon.metrics.truth import BODY_JOINTS


def accuracy(motion: Track, on: Comparison) -> Scores:
    """Errors against the reference.

    Args:
        motion: with all of `BODY_JOINTS`.
        on: what the motions are compared on.
    """
    a, b = (x.at(on.times_s, BODY_JOINTS) for x in (motion, on.truth))  # (T, 12, 3)
    root, truth_root = a[:, :2].mean(1), b[:, :2].mean(1)  # (T, 3) between the hips, which come first
    dt = on.interval_s
    series = {
        "mpjpe_g_mm": of_frames(pose.distances(a, b), scale=1e3),
        "mpjpe_mm": of_frames(pose.mpjpe_errors(a, b, root, truth_root), scale=1e3),
        "mpjpe_pa_mm": of_frames(pose.mpjpe_pa_errors(a, b), scale=1e3),
        "mpjpe_g_align1_mm": of_frames(pose.mpjpe_g_align1_errors(a, b, root, truth_root), scale=1e3),
        "mpjpe_g_rigid1_mm": of_frames(pose.mpjpe_g_rigid1_errors(a, b), scale=1e3),
        "root_mm": of_frames(pose.distances(root, truth_root), scale=1e3),
        "velocity_mps": of_frames(smoothness.velocity_errors(a, b), scale=1 / dt),
        "accel_mps2": of_frames(smoothness.acceleration_errors(a, b), scale=1 / dt**2),
        "pck_pct": of_frames(pose.pck_hits(a, b, root, truth_root), scale=100.0),
        **_world(motion, on),
        **_slow(motion, on),
    }
    rte = pose.root_translation_error_pct(root, truth_root) if np.isfinite(root).all() else np.nan
    return Scores(series, {"rte_pct": float(rte)}) | _resting(motion, on)


def _world(motion: Track, on: Comparison) -> dict[str, Series]:
    """W- and WA-MPJPE at 30 frames a second; none if a joint is unknown."""
    a, b = (x.at(on.slow_s, BODY_JOINTS) for x in (motion, on.truth))
    if not np.isfinite(a).all():
        return {}
    return {
        f"{name}_{ending}": of_frames(pose.w_mpjpe_errors(a, b, first=first, with_scale=scaled), scale=1e3)
        for name, first in (("w_mpjpe", True), ("wa_mpjpe", False))
        for ending, scaled in (("mm", True), ("rigid_mm", False))
    }


def _slow(motion: Track, on: Comparison) -> dict[str, Series]:
    """Gärtner 2022 eq. 10 in m/s and Xie 2021 in mm, at 25 frames a second."""
    times = every(on.times_s, H36M_HZ)
    a, b = (x.at(times, BODY_JOINTS) for x in (motion, on.truth))
    speed = smoothness.speed_errors(a, b)
    series = {
        "velocity_gartner_mps": of_frames(speed, scale=H36M_HZ),
        "e_smooth_mm": of_frames(speed, scale=1e3),
    }
    points = on.feet_of(motion)
    if points:
        a, b = (x.at(times, points) for x in (motion, on.truth))
        series["e_foot_z_mm"] = of_frames(smoothness.foot_height_errors(a, b), scale=1e3)
        series["e_foot_vxy_mm"] = of_frames(smoothness.foot_step_errors(a, b), scale=1e3)
    return series


def _resting(motion: Track, on: Comparison) -> Scores:
    """Skating of foot points where the reference's rest, at the clip's own rate; none with few contacts."""
    points = on.feet_of(motion)
    if not points:
        return Scores()
    a, b = (x.at(on.times_s, points) for x in (motion, on.truth))
    resting = contact.reference_contacts(b, on.interval_s)  # (T-1, F)
    if resting.sum() < contact.CONTACTS_MIN:
        return Scores()
    speed, truth_speed = (smoothness.steps(x) / on.interval_s for x in (a, b))
    series = {
        "footskate_pct": of_frames(feet.fast_steps(a, on.interval_s), resting, scale=100.0),
        "foot_slide_mps": of_frames(speed, resting),
        "foot_slide_truth_mps": of_frames(truth_speed, resting),
        "foot_height_err_mm": of_frames(smoothness.foot_height_errors(a, b)[1:], resting, scale=1e3),
    }
    slide_off = abs(series["foot_slide_mps"].value - series["foot_slide_truth_mps"].value)
    return Scores(series, {"foot_contact_frames": float(resting.sum()), "foot_slide_off_mps": slide_off})
