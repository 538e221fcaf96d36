"""Scores of a motion, with or without a reference, as pure functions of arrays (docs/metrics.md).

A score is the mean over frames of what one function gives for each (`statistics.of_frames`): `evaluation` and
the report of a result make theirs of these.

pose           errors of joints; alignment: what comes before them
smoothness     errors of steps and accelerations, jitter
feet           skating, floating, sinking; contact: when feet rest; clearance: depth and flight of a body
touch          which parts are near the scene; bones: capsules around joints; anthropometry: centre of mass
dynamics       forces, torques, power; filters: their low-pass
statistics     scores of frames and their intervals; rates: other times and rates
truth          references; definitions: what each score means, in one line
"""

from __future__ import annotations

from simrecon.metrics.clearance import box_clearance, flight_frames, penetrating_frames, penetration_depths
from simrecon.metrics.contact import contact_f1, frame_contacts, reference_contacts
from simrecon.metrics.dynamics import (
    ballistic_grf_pct,
    body_weight_pct,
    centre_of_pressure_error,
    correlation,
    grf_norm_pct,
    implied_grf,
    peak_power,
    peak_torque,
    residual_pct,
)
from simrecon.metrics.feet import (
    fast_steps,
    float_annotated_frames,
    float_body_frames,
    float_frames,
    floating_points,
    footskate_annotated_steps,
    footskate_steps,
    penetrating_points,
    resting_steps,
    skating_points,
)
from simrecon.metrics.pose import (
    distances,
    mpjpe_errors,
    mpjpe_g_align1_errors,
    mpjpe_g_rigid1_errors,
    mpjpe_pa_errors,
    pck_hits,
    root_translation_error_pct,
    w_mpjpe_errors,
)
from simrecon.metrics.smoothness import (
    acceleration_errors,
    foot_height_errors,
    foot_step_errors,
    jerks,
    speed_errors,
    velocity_errors,
)
from simrecon.metrics.statistics import Scores, Series, interval, intervals, of_frames
from simrecon.metrics.truth import BODY_JOINTS, FOOT_POINTS, TRUTH_SCHEMA, Truth, read_truth

__all__ = [
    "BODY_JOINTS",
    "FOOT_POINTS",
    "TRUTH_SCHEMA",
    "Scores",
    "Series",
    "Truth",
    "acceleration_errors",
    "ballistic_grf_pct",
    "body_weight_pct",
    "box_clearance",
    "centre_of_pressure_error",
    "contact_f1",
    "correlation",
    "distances",
    "fast_steps",
    "flight_frames",
    "float_annotated_frames",
    "float_body_frames",
    "float_frames",
    "floating_points",
    "foot_height_errors",
    "foot_step_errors",
    "footskate_annotated_steps",
    "footskate_steps",
    "frame_contacts",
    "grf_norm_pct",
    "implied_grf",
    "interval",
    "intervals",
    "jerks",
    "mpjpe_errors",
    "mpjpe_g_align1_errors",
    "mpjpe_g_rigid1_errors",
    "mpjpe_pa_errors",
    "of_frames",
    "pck_hits",
    "peak_power",
    "peak_torque",
    "penetrating_frames",
    "penetrating_points",
    "penetration_depths",
    "read_truth",
    "reference_contacts",
    "residual_pct",
    "resting_steps",
    "root_translation_error_pct",
    "skating_points",
    "speed_errors",
    "velocity_errors",
    "w_mpjpe_errors",
]
