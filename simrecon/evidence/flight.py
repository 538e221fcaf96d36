"""Whether a person in the air falls as fast as everything does: the one clock that a motion brings along."""

from __future__ import annotations

import numpy as np

from simrecon.types import Array, Evidence, runs

GRAVITY_MPS2 = 9.81
SEGMENTS = {
    ("shoulder", "hip"): 0.578, ("shoulder", "elbow"): 0.056, ("elbow", "wrist"): 0.044,
    ("hip", "knee"): 0.2, ("knee", "ankle"): 0.122,
}  # fmt: skip
"""Mass of both sides between two joints, as a share (Winter 2009, table 4.1), each in the middle. The head is
part of the trunk, hands and feet of the segments above them."""
ALOFT_M, LEAST_FRAMES, LEAST_S = 0.15, 6, 0.06
"""Over the floor, of the lowest joint: ankles and balls of feet that push off stay below."""
TIMES = 2.0
"""A fall that is that much too fast is not explained by errors of the centre of mass, some m/s² in a turn."""
FLOOR_SHARE = 0.1


def check(evidence: Evidence) -> str:
    """A line for evidence whose longest flight is a fall much faster than free; else empty.

    Args:
        evidence: joints in the world, m.
    """
    at = {name: evidence.joints_m[:, k] for k, name in enumerate(evidence.joint_names)}
    centre = _centre(at)
    feet = [
        places[:, 2] for name, places in at.items() if name.split("_")[-1] in ("ankle", "heel", "toe", "mtp")
    ]
    if centre is None or not feet:
        return ""
    low = np.min(np.stack([places[:, 2] for places in at.values()]), axis=0)  # NaN where one is unseen
    known = np.isfinite(low) & np.isfinite(centre)
    if not known.any():
        return ""
    aloft = known & (np.nan_to_num(low) > np.quantile(low[known], FLOOR_SHARE) + ALOFT_M)
    rows = max(runs(aloft), key=lambda run: run.stop - run.start, default=slice(0, 0))
    clock = evidence.times_s[rows]
    if len(clock) < LEAST_FRAMES or clock[-1] - clock[0] < LEAST_S:
        return ""
    times = clock - clock[0]
    fall = -2 * float(np.polynomial.Polynomial.fit(times, centre[rows], 2).convert().coef[2])
    if fall <= TIMES * GRAVITY_MPS2:
        return ""
    rate = 1 / float(np.median(np.diff(evidence.times_s)))
    found = f"a person in the air from {clock[0]:.2f} to {clock[-1]:.2f} s who falls at {fall:.0f} m/s²"
    right = rate * (GRAVITY_MPS2 / fall) ** 0.5
    return f"frame rate: found {found}; valid: 9.8 m/s², as at about --fps {right:.0f} instead of {rate:.0f}"


def _centre(at: dict[str, Array]) -> Array | None:
    """Height (T,) of the centre of mass, from segments between joints; None where the trunk is missing."""
    total, height = 0.0, np.zeros(())
    for (above, below), share in SEGMENTS.items():
        names = [f"{side}_{joint}" for joint in (above, below) for side in ("left", "right")]
        if set(names) <= set(at):
            total, height = (
                total + share,
                height + share * np.mean([at[name][:, 2] for name in names], axis=0),
            )
    return np.asarray(height / total) if total > 0.5 else None
