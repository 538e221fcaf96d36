"""Which of two results is the better one, so that it is not replaced."""

from __future__ import annotations

from simrecon.results.verdict import LEVELS, is_plan
from simrecon.types import Report

SAME_SHARE = 0.01
"""Of the frames: two results differ if more of one of them are not simulated."""
WORSE, SAME_M = 1.5, 0.005
"""Distance from the kinematic fit, over that of an earlier result, and in m: seeds differ by a tenth."""


def is_worse(report: Report, earlier: Report) -> bool:
    """Whether a result is worse than an earlier one, that it should not replace.

    A plan is worse than a simulation. Otherwise by verdict first, then by the share of frames that are not
    simulated; of the same input with the same verdict also if the simulation is half as far again from its
    fit. Reports of earlier versions have no verdict, and are compared by their frames.
    """
    if is_plan(report) != is_plan(earlier):
        return is_plan(report)
    levels = [
        LEVELS.index(one["verdict"]["verdict"]) if "verdict" in one else None for one in (report, earlier)
    ]
    if None not in levels and levels[0] != levels[1]:
        return levels[0] > levels[1]  # type: ignore[operator]
    ours, theirs = (one["frames"]["fallback"] / one["frames"]["count"] for one in (report, earlier))
    if abs(ours - theirs) > SAME_SHARE:
        return bool(ours > theirs)
    if None in levels or report["input"]["sha256"] != earlier["input"]["sha256"]:
        return False
    near, far = (one["agreement"]["fit_mean_m"] for one in (earlier, report))
    return bool(far > WORSE * near + SAME_M)
