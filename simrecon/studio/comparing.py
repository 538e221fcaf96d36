"""A/B: two results of a clip side by side, as a table of what got better."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from simrecon.contact import rules
from simrecon.metrics import smoothness
from simrecon.studio.clip import Clip
from simrecon.types import Report

SEAT = ("pelvis", "left_buttock", "right_buttock")
"""Primitives that a seat pushes."""
_SAME = 0.005
"""Of the larger value: a change that is no change."""


@dataclass(frozen=True)
class Row:
    """One figure of two results; None where it is not known.

    Attributes:
        name: with its unit.
        before, after: of A and of B.
        less_is_better: None: neither is.
    """

    name: str
    before: float | None
    after: float | None
    less_is_better: bool | None

    @property
    def change(self) -> str:
        """`better`, `worse`, `same`, or empty where nothing can be said."""
        if self.before is None or self.after is None:
            return ""
        if abs(self.after - self.before) <= _SAME * max(abs(self.before), abs(self.after), 1e-9):
            return "same"
        if self.less_is_better is None:
            return "other"
        return "better" if (self.after < self.before) == self.less_is_better else "worse"


@dataclass(frozen=True)
class _Figure:
    name: str
    less_is_better: bool | None
    value: Callable[[Clip, Report], Any]
    digits: int = 1


def _seat_N(clip: Clip, _: Report) -> float | None:
    """Mean vertical force on pelvis and buttocks, while it is loaded."""
    if clip.motion is None:
        return None
    rows = [clip.motion.contact_body.index(name) for name in SEAT]
    force = clip.motion.contact_force_N[:, rows, 2].sum(axis=1)
    loaded = force[rules.loaded(force)]
    return float(loaded.mean()) if len(loaded) else 0.0


def _jerk_mps3(clip: Clip, _: Report) -> float | None:
    """Mean jerk of the body's points."""
    if clip.motion is None or clip.frames < 5:
        return None
    step = float(np.median(np.diff(clip.times_s)))
    return float(smoothness.jerks(clip.motion.joints_m, 1.0 / step).mean())


_FIGURES = (
    _Figure("frames that are not simulated", True, lambda _, r: r["frames"]["fallback"], 0),
    _Figure("loss, mean of the windows", True, lambda _, r: _mean(w["loss"] for w in r["windows"])),
    _Figure("from the kinematic fit, mm", True, lambda _, r: 1e3 * r["agreement"]["fit_mean_m"]),
    _Figure("from the landmarks, px", True, lambda _, r: r["agreement"]["image_px"]),
    _Figure("deepest in the floor, mm", True, lambda _, r: r["audit"]["floor_penetration_max_mm"]),
    _Figure("force on the seat, N", None, _seat_N, 0),
    _Figure("jerk, m/s³", True, _jerk_mps3, 0),
    _Figure("wishes for contacts that hold, %", False, lambda _, r: _held_pct(r), 0),
)


def table(before: tuple[Clip, Report] | None, after: tuple[Clip, Report]) -> tuple[Row, ...]:
    """The figures that are known of either of two results, A and B; without an A, of B alone."""
    rows = []
    for figure in _FIGURES:
        a, b = (None if one is None else _value(figure, *one) for one in (before, after))
        if a is not None or b is not None:
            rows.append(Row(figure.name, a, b, figure.less_is_better))
    return tuple(rows)


def verdict(rows: tuple[Row, ...]) -> str:
    """How many figures got better, in words; empty where there is nothing to compare with."""
    if all(row.before is None for row in rows):
        return ""
    better, worse = (sum(row.change == word for row in rows) for word in ("better", "worse"))
    return f"{better} better, {worse} worse"


def markdown(rows: tuple[Row, ...], names: tuple[str, str] = ("A", "B")) -> str:
    """The table as text."""
    lines = [f"| | {names[0]} | {names[1]} | |", "|---|---:|---:|---|"]
    lines += [f"| {r.name} | {_shown(r.before)} | {_shown(r.after)} | {_marked(r.change)} |" for r in rows]
    return "\n".join(lines)


def _value(figure: _Figure, clip: Clip, report: Report) -> float | None:
    """A figure, rounded; None where the report, perhaps of an earlier version, does not have it."""
    try:
        value = figure.value(clip, report)
    except (KeyError, TypeError, ValueError, IndexError):
        return None
    return None if value is None or not np.isfinite(value) else round(float(value), figure.digits)


def _mean(values: Any) -> float | None:
    known = [float(value) for value in values]
    return float(np.mean(known)) if known else None


def _held_pct(report: Report) -> float | None:
    wishes = report.get("contacts", {}).get("wishes", [])
    return _mean(100 * (wish["simulated_share"] or 0.0) for wish in wishes)


def _shown(value: float | None) -> str:
    return "-" if value is None else f"{value:g}"


def _marked(change: str) -> str:
    return f"**{change}**" if change == "better" else change
