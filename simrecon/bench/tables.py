"""Tables of a suite in Markdown; pure functions of the rows of its runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from simrecon.bench import rows
from simrecon.bench.rows import RUN, Row, over_seeds
from simrecon.bench.schema import Column, Suite, Table

MISSING = "–"
CHANGE_PCT = 1.0
"""Rise of an error above which a variant counts as worse than the first."""
_FIXED = ("result", "kinematic", "plan", "input", "reference", RUN)


def table_lines(suite: Suite, table: Table, runs: Sequence[Row]) -> list[str]:
    """One table, line by line.

    Args:
        suite: gives clips and variants.
        table: what is in it.
        runs: of the suite.
    """
    ran, used = {run["clip"] for run in runs}, {run["variant"] for run in runs}
    clips = [name for name in table.clips or [clip.name for clip in suite.clip] if name in ran]
    variants = [variant for variant in suite.variant if variant.name in used]
    first = suite.variant[0].name
    if table.rows == "change":
        return _changes(suite, table, runs, clips, [v.name for v in variants if v.name != first])
    head = [table.rows, *(column.title for column in table.columns)]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    if table.rows == "clip":
        for clip in clips:
            lines.append(_line(clip, table, _over_clips(runs, [clip], first), runs, clip, first))
    elif table.rows == "variant":
        for variant in variants:
            name = f"{variant.name} ({variant.paper})" if variant.paper else variant.name
            lines.append(_line(name, table, _over_clips(runs, clips, variant.name), runs, None, variant.name))
    else:
        for clip in clips:
            lines += _methods(clip, first, table, runs)
    return lines


def _changes(
    suite: Suite, table: Table, runs: Sequence[Row], clips: Sequence[str], variants: Sequence[str]
) -> list[str]:
    """Per cent by which each variant's mean error is above the first's, over the clips that have both.

    In brackets the clips on which it is worse, of how many. The last column names the errors that rise by
    more than a per cent and on more than half of the clips: by these, what the variant lacks earns its place.
    """
    head = ["against the first", *(column.title for column in table.columns), "worse"]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for variant in variants:
        cells, worse = [variant], []
        for column in table.columns:
            old, new = (
                np.array([over_seeds(runs, clip, name, column.of[-1], column.score) for clip in clips])
                for name in (suite.variant[0].name, variant)
            )
            both = np.isfinite(old) & np.isfinite(new)
            base, count = old[both].sum(), int((new > old)[both].sum())
            if not both.any() or base <= 0:
                cells.append(MISSING)
                continue
            change = 100.0 * (new[both].sum() / base - 1.0)
            cells.append(f"{change:+.{column.digits}f} % ({count} of {both.sum()})")
            if change > CHANGE_PCT and 2 * count > both.sum():
                worse.append(column.title)
        lines.append("| " + " | ".join([*cells, ", ".join(worse) or "nothing"]) + " |")
    return lines


def _over_clips(runs: Sequence[Row], clips: Sequence[str], variant: str) -> Callable[[str, str], float]:
    def mean(motion: str, score: str) -> float:
        return rows.mean(over_seeds(runs, clip, variant, motion, score) for clip in clips)

    return mean


def _methods(clip: str, variant: str, table: Table, runs: Sequence[Row]) -> list[str]:
    """A line for each motion of a clip: the result, what it was made from, and other methods."""
    chosen = [run for run in runs if run["clip"] == clip and run["variant"] == variant and "scores" in run]
    there = list(dict.fromkeys(motion for run in chosen for motion in run["scores"]))
    lines = []
    for motion in there:
        known = {
            column.score: over_seeds(runs, clip, variant, motion, column.score) for column in table.columns
        }
        if any(math.isfinite(score) for score in known.values()):
            label = motion if motion in _FIXED else f"{motion} (other method)"
            cells = [_number(known[column.score], column.digits) for column in table.columns]
            lines.append("| " + " | ".join([f"{clip}: {label}", *cells]) + " |")
    return lines


def _line(
    name: str,
    table: Table,
    score: Callable[[str, str], float],
    runs: Sequence[Row],
    clip: str | None,
    variant: str,
) -> str:
    cells = [name]
    there = {motion for run in runs for motion in run.get("scores", ())} | {RUN}
    for column in table.columns:
        # what no run has, such as a plan where nothing plans, is left out
        of = [motion for motion in column.of if motion in there] or column.of
        shown = [(motion, score(motion, column.score)) for motion in of]
        known = any(math.isfinite(value) for _, value in shown)
        cell = " → ".join(_number(value, column.digits) for _, value in shown) if known else MISSING
        if column.interval and clip is not None:
            cell += _interval(runs, clip, variant, column)
        cells.append(cell)
    return "| " + " | ".join(cells) + " |"


def _interval(runs: Sequence[Row], clip: str, variant: str, column: Column) -> str:
    """The interval of the last motion of a column, of the first seed."""
    for run in runs:
        if (run["clip"], run["variant"]) == (clip, variant) and "intervals" in run:
            pair = run["intervals"].get(column.of[-1], {}).get(column.score)
            return "" if pair is None else f" [{pair[0]:.{column.digits}f}, {pair[1]:.{column.digits}f}]"
    return ""


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else MISSING
