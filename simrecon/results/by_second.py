"""Each second of a result: `good`, `doubtful` or `bad`, and why (docs/formats.md).

The rules are those of the whole (`verdict`), of the frames of one second, and two more: what the reference
asks for there, and where its feet are while they stand.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from simrecon import scene as scenes
from simrecon.contact import labels
from simrecon.engines import restarts
from simrecon.io.messages import counted
from simrecon.metrics import pose
from simrecon.pipeline import Reconstruction
from simrecon.replay import FALLBACK
from simrecon.results import agreement, ending, verdict
from simrecon.results.verdict import BAD, DOUBTFUL, GOOD, LEVELS, graded
from simrecon.types import Array, Flags, IntArray, Motion, Report

Why = tuple[str, str]
"""A verdict and its reason."""

SOLE_M = (0.05, 0.10)
"""Mean distance of standing feet from what is under them: shoes and landmarks err by 2 to 3 cm."""
STANDS = 0.5
"""How surely a foot stands that is looked at."""


def make(run: Reconstruction) -> list[dict[str, Any]]:
    """The section `by_second` of a report: `from_s`, `to_s`, `verdict` and `reason`, empty for a good one."""
    return _seconds(run.motion.times_s, _OfRun(run).reasons)


def of_motion(motion: Motion, off_m: Array | None, unseen: Flags) -> list[dict[str, Any]]:
    """The same by what a result of an earlier version, whose report has no such section, still knows.

    Args:
        motion: of T frames.
        off_m: (T,) mean distance of its points from those of the kinematic fit; None: there is no fit.
        unseen: (T,) whether the person was out of view.
    """
    return _seconds(motion.times_s, _Frames(motion, off_m, unseen).reasons)


def _seconds(times_s: Array, reasons: Callable[[IntArray], Iterator[Why]]) -> list[dict[str, Any]]:
    numbers = np.floor(times_s - times_s[0] + 1e-6).astype(np.int64)
    if len(times_s) > 1 and (numbers == numbers[-1]).sum() < 2:
        numbers[numbers == numbers[-1]] -= numbers[-1] > 0  # the last frame is no second of its own
    seconds = []
    for number in np.unique(numbers):
        rows = np.flatnonzero(numbers == number)
        found = sorted(reasons(rows), key=lambda one: -LEVELS.index(one[0]))
        level, reason = found[0] if found else (GOOD, "")
        ends = float(times_s[rows[0]]), float(times_s[rows[-1]])
        seconds.append({"from_s": ends[0], "to_s": ends[1], "verdict": level, "reason": reason})
    return seconds


class _Frames:
    """What is known of each frame of a motion, and the rules that need no more than that."""

    def __init__(self, motion: Motion, off_m: Array | None, unseen: Flags) -> None:
        self.motion, self.off_m, self.unseen = motion, off_m, unseen

    def reasons(self, rows: IntArray) -> Iterator[Why]:
        """Verdict and reason of everything that is wrong in some frames of the motion."""
        fallback = self.motion.status[rows] == FALLBACK
        if fallback.any():
            level = BAD if fallback.mean() > verdict.FALLBACK_SHARE else DOUBTFUL
            yield level, self.not_simulated(rows[fallback])
        lost = float(self.unseen[rows].mean())
        if (level := graded(lost, verdict.UNSEEN_SHARE)) != GOOD:
            yield level, f"landmarks lost in {100 * lost:.0f} % of the frames"
        own = rows[self.motion.kept[rows]]
        if self.off_m is None or not own.size:
            return
        mean_m, most_m = float(self.off_m[own].mean()), float(self.off_m[own].max())
        level = max(graded(mean_m, verdict.FIT_M), graded(most_m, verdict.FIT_MAX_M), key=LEVELS.index)
        if level != GOOD:
            yield level, f"{100 * most_m:.0f} cm from the kinematic fit at worst"

    def not_simulated(self, rows: IntArray) -> str:
        """Why some frames are not."""
        return f"{counted(len(rows), 'frame')} not simulated"


class _OfRun(_Frames):
    """The same of a run that has just ended, of which more is known."""

    def __init__(self, run: Reconstruction) -> None:
        self.rows = agreement.frames_of(run)  # (T,) of the uniform clock
        off_m = pose.distances(run.motion.joints_m, run.problem.points_m[self.rows]).mean(axis=1)
        super().__init__(run.motion, off_m, run.fit.interpolated[self.rows])
        self.run, self.gaps = run, ending.make(run)
        image = agreement.in_image(run, np.ones(len(self.rows), bool))
        self.image_px = None if image is None else image.by_frame()
        self.person_px = None if image is None else image.person_px
        self.sole_m = _soles_m(run)[self.rows]
        self.load = restarts.loads(run.problem, run.fit)  # of the uniform clock

    def reasons(self, rows: IntArray) -> Iterator[Why]:
        """See `_Frames`."""
        yield from super().reasons(rows)
        own = rows[self.motion.kept[rows]]
        if own.size:
            yield from self._image(own)
        shown = np.unique(self.rows[rows])
        if asked := restarts.impossible(self.run.problem, self.run.fit, shown, self.load):
            yield DOUBTFUL, f"unexplained force in the reference: {asked}"
        sole = self.sole_m[rows]
        if np.isfinite(sole).any() and (level := graded(float(np.nanmean(sole)), SOLE_M)) != GOOD:
            yield level, f"floor uncertain: standing feet are {100 * np.nanmean(sole):.0f} cm from it"

    def not_simulated(self, rows: IntArray) -> str:
        """See `_Frames`."""
        time_s = float(self.motion.times_s[rows[0]])
        gap = next(gap for gap in self.gaps if gap["from_s"] <= time_s <= gap["to_s"])
        return f"not simulated ({gap['reason']}: {gap['detail']})"

    def _image(self, rows: IntArray) -> Iterator[Why]:
        if self.image_px is None or not self.person_px or not np.isfinite(self.image_px[rows]).any():
            return
        share = 100 * float(np.nanmean(self.image_px[rows])) / self.person_px
        if (level := graded(share, verdict.PERSON_PCT)) != GOOD:
            yield level, f"{share:.1f} % of the person's height from the landmarks"


def _soles_m(run: Reconstruction) -> Array:
    """Distance of the lower standing foot of the fit from what is under it, (T,); NaN where none stands."""
    fit = run.fit
    apart = np.full(len(fit.times_s), np.nan)
    if fit.contacts is None:
        return apart
    names = fit.body.skeleton.point_names
    feet = [[names.index(f"{side}_{end}") for end in ("heel", "toe")] for side in ("left", "right")]
    points = run.problem.points_m[:, feet]  # (T, 2, 2, 3)
    height = (points[..., 2] - scenes.support_height(fit.scene, points[..., :2])).min(axis=-1)  # (T, 2)
    stands = np.nan_to_num(labels.standing(fit.contacts)).T > STANDS  # (T, 2)
    known = stands.any(axis=1)
    apart[known] = np.abs(np.where(stands, height, np.inf)[known]).min(axis=1)
    return apart


def short(report: Report) -> list[tuple[str, str]]:
    """Spans of seconds with one verdict and reason, in words: when, and what."""
    spans: list[dict[str, Any]] = []
    for second in report.get("by_second", []):  # reports of earlier versions have none
        same = spans and all(spans[-1][key] == second[key] for key in ("verdict", "reason"))
        if same:
            spans[-1] = {**spans[-1], "to_s": second["to_s"]}
        else:
            spans.append(second)
    return [
        (f"{span['from_s']:.1f} to {span['to_s']:.1f} s", _said(span["verdict"], span["reason"]))
        for span in spans
    ]


def _said(level: str, reason: str) -> str:
    return f"{level}: {reason}" if reason else level
