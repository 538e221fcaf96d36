"""Whether each second of a motion can be believed: as its report says, or by what an earlier result holds."""

from __future__ import annotations

from typing import Any

import numpy as np

from simrecon import kinematics
from simrecon.io.messages import counted
from simrecon.metrics import pose
from simrecon.results import Result, kinematic, verdict
from simrecon.types import Array, Flags, Motion


def seconds(result: Result) -> list[dict[str, Any]]:
    """The verdict on each second, the last one perhaps shorter: `by_second` of the report.

    Of a result whose report has none, a second is as bad as the worst of: frames that are not simulated
    (bad), distance of the simulation from the kinematic fit (`verdict.FIT_M`, in the worst frame
    `verdict.FIT_MAX_M`), and frames in which the person was out of view (`verdict.UNSEEN_SHARE`).

    Returns:
        `from_s` and `to_s` from the first frame on, `verdict`, `reason` of each.
    """
    motion = result.motion
    if (told := result.report.get("by_second")) is not None:
        return _joined(told, float(motion.times_s[0]), float(motion.times_s[-1]))
    apart_m, unseen = from_fit_m(result), _unseen(result)
    after = motion.times_s - motion.times_s[0]
    rows = np.minimum(np.floor(after).astype(int), max(int(np.ceil(after[-1])) - 1, 0))
    found = []
    for row in np.unique(rows):
        frames = rows == row
        level, reason = _judged(motion, frames, apart_m, unseen)
        first, end = float(row), float(min(row + 1, after[-1]))
        found.append({"from_s": first, "to_s": end, "verdict": level, "reason": reason})
    return found


def _joined(told: list[dict[str, Any]], first_s: float, last_s: float) -> list[dict[str, Any]]:
    """The seconds of a report one after the other, without gaps from the last frame of one to the next."""
    ends = [second["from_s"] for second in told[1:]] + [last_s]
    return [
        {**second, "from_s": second["from_s"] - first_s, "to_s": end - first_s}
        for second, end in zip(told, ends, strict=True)
    ]


def from_fit_m(result: Result) -> Array | None:
    """Mean distance (T,) of the simulated body's points from the kinematic fit's; None without a fit."""
    motion, body = result.motion, result.body
    if motion.kinematic_qpos is None:
        return None
    own = motion.kinematic_qpos[:, : kinematic.coordinates(body)]
    points_m = kinematics.configurations(body, own)[1]
    return np.asarray(pose.distances(motion.joints_m, points_m).mean(axis=1))


def _judged(motion: Motion, frames: Flags, apart_m: Array | None, unseen: Flags) -> tuple[str, str]:
    lost = int(np.count_nonzero(~motion.kept[frames]))
    if lost:
        return verdict.BAD, f"{counted(lost, 'frame')} not simulated"
    reasons = []
    if apart_m is not None:
        mean_m, most_m = float(apart_m[frames].mean()), float(apart_m[frames].max())
        level = max(
            verdict.graded(mean_m, verdict.FIT_M),
            verdict.graded(most_m, verdict.FIT_MAX_M),
            key=verdict.LEVELS.index,
        )
        reasons.append((level, f"{1e3 * mean_m:.0f} mm from the kinematic fit, {1e3 * most_m:.0f} at most"))
    share = float(unseen[frames].mean())
    if share > verdict.UNSEEN_SHARE[0]:
        level = verdict.graded(share, verdict.UNSEEN_SHARE)
        reasons.append((level, f"out of view in {100 * share:.0f} % of the frames"))
    reasons.sort(key=lambda reason: -verdict.LEVELS.index(reason[0]))
    return reasons[0] if reasons else (verdict.GOOD, "simulated")


def _unseen(result: Result) -> Flags:
    unseen = np.zeros(len(result.motion.times_s), dtype=np.bool_)
    rows = [row for row in result.report["frames"].get("interpolated_frames", []) if row < len(unseen)]
    unseen[rows] = True
    return unseen
