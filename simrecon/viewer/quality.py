"""Whether each second of a motion can be believed: as its report says, or by what an earlier result holds."""

from __future__ import annotations

from typing import Any

import numpy as np

from simrecon import kinematics
from simrecon.metrics import pose
from simrecon.results import Result, by_second, kinematic
from simrecon.types import Array, Flags


def seconds(result: Result) -> list[dict[str, Any]]:
    """The verdict on each second, the last one perhaps shorter: `by_second` of the report.

    Of a result of an earlier version, whose report has none, it is made by those of the same rules that the
    folder has all for.

    Returns:
        `from_s` and `to_s` from the first frame on, `verdict`, `reason` of each.
    """
    motion = result.motion
    told = result.report.get("by_second")
    if told is None:
        told = by_second.of_motion(motion, from_fit_m(result), _unseen(result))
    return _joined(told, float(motion.times_s[0]), float(motion.times_s[-1]))


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


def _unseen(result: Result) -> Flags:
    unseen = np.zeros(len(result.motion.times_s), dtype=np.bool_)
    rows = [row for row in result.report["frames"].get("interpolated_frames", []) if row < len(unseen)]
    unseen[rows] = True
    return unseen
