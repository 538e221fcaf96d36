"""Scores of a motion, with or without a reference, as pure functions of arrays (docs/metrics.md).

Modules: `pose` (positions), `smoothness` (velocity, acceleration, jitter), `contact`, `bodies` (clearance),
`dynamics` (forces, torques), `statistics` (intervals, filter), `truth` (references), `joints` (all that
joints allow, together) and `definitions`.
"""

from __future__ import annotations

from simrecon.metrics.contact import (
    CONTACT_DYNAMICS_M,
    CONTACT_KINEMATICS_M,
    box_clearance,
    float_pct,
    foot_metrics,
    footskate_pct,
    penetration,
    reference_contacts,
)
from simrecon.metrics.joints import evaluate
from simrecon.metrics.pose import (
    first_frame_aligned,
    mpjpe,
    mpjpe_2d,
    mpjpe_g,
    mpjpe_g_align1,
    mpjpe_pa,
    procrustes,
    root_error,
)
from simrecon.metrics.smoothness import acceleration, velocity, velocity_gartner
from simrecon.metrics.truth import ALIASES, BODY_JOINTS, FOOT_POINTS, TRUTH_SCHEMA, Truth, read_truth

__all__ = [
    "ALIASES",
    "BODY_JOINTS",
    "CONTACT_DYNAMICS_M",
    "CONTACT_KINEMATICS_M",
    "FOOT_POINTS",
    "TRUTH_SCHEMA",
    "Truth",
    "acceleration",
    "box_clearance",
    "evaluate",
    "first_frame_aligned",
    "float_pct",
    "foot_metrics",
    "footskate_pct",
    "mpjpe",
    "mpjpe_2d",
    "mpjpe_g",
    "mpjpe_g_align1",
    "mpjpe_pa",
    "penetration",
    "procrustes",
    "read_truth",
    "reference_contacts",
    "root_error",
    "velocity",
    "velocity_gartner",
]
