"""Tables of a suite in Markdown, and what its targets come to; pure functions of the rows of its runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from simrecon.bench.schema import Bound, Column, Suite, Table, Target
from simrecon.errors import InputError

Row = dict[str, Any]
RUN = "run"
"""The motion whose scores are what a run says of itself."""
MISSING = "–"
CHANGE_PCT = 1.0
"""Rise of an error above which a variant counts as worse than the first."""
_FIXED = ("result", "kinematic", "input", "reference", RUN)


def page(suite: Suite, content: Row) -> str:
    """The Markdown of a suite.

    Args:
        suite: gives the tables.
        content: what `runner.run` returns.
    """
    runs = content["runs"]
    seeds = ", ".join(map(str, suite.seeds))
    lines = [
        f"# Suite `{suite.name}`",
        "",
        suite.purpose,
        "",
        f"Plan `{suite.plan}`, seed {seeds}. {_made_on(content)}",
    ]
    for table in suite.table:
        lines += ["", f"## {table.title}", ""]
        lines += [table.text.strip(), ""] if table.text else []
        lines += _table(suite, table, runs)
    if content.get("checks"):
        lines += ["", "## Formulas", "", *_checks(content["checks"])]
    if content["targets"]:
        lines += ["", "## Targets", "", *_targets(content["targets"])]
    failed = [run for run in runs if run["status"] == "failed"]
    if failed:
        lines += ["", "## Failed", ""]
        lines += [
            f"- {run['clip']}, {run['variant']}, seed {run['seed']}: {run['message']}" for run in failed
        ]
    return "\n".join(lines) + "\n"


def replaced(text: str, name: str, section: str) -> str:
    """A page with the section of a suite put between its markers, which are added at the end if missing.

    Args:
        text: of the page.
        name: of the suite.
        section: Markdown of the suite; its headings go one level down.

    Raises:
        InputError: one marker without the other.
    """
    start, end = f"<!-- bench {name} -->", f"<!-- end of bench {name} -->"
    lower = "\n".join(f"#{line}" if line.startswith("#") else line for line in section.strip().splitlines())
    block = f"{start}\n{lower}\n{end}"
    if (text.count(start), text.count(end)) == (0, 0):
        return f"{text.rstrip()}\n\n{block}\n" if text.strip() else f"{block}\n"
    if (text.count(start), text.count(end)) != (1, 1) or text.index(start) > text.index(end):
        raise InputError(
            f"found the markers {start} and {end} not once each and in this order; valid: both, or none"
        )
    return text[: text.index(start)] + block + text[text.index(end) + len(end) :]


def value(run: Row, motion: str, score: str) -> float:
    """A score of a run; NaN if it has none."""
    if run["status"] == "failed":
        return math.nan
    scores = run["run"] if motion == RUN else run["scores"].get(motion, {})
    return float(scores.get(score, math.nan))


def over_seeds(runs: Iterable[Row], clip: str, variant: str, motion: str, score: str) -> float:
    """Mean over the seeds of a clip's variant that have the score; NaN if none has."""
    chosen = [run for run in runs if run["clip"] == clip and run["variant"] == variant]
    return _mean(value(run, motion, score) for run in chosen)


def targets(suite: Suite, runs: Sequence[Row]) -> list[Row]:
    """What each target comes to, with the first variant.

    Returns:
        `text`, `must`, `reach` (each a list of `measure`, `limit`, `value`, `met`), `met_must`, `met_reach`
        (None without bounds or values) and `worst_clip`.
    """
    return [_target(suite, target, runs) for target in suite.target]


def _target(suite: Suite, target: Target, runs: Sequence[Row]) -> Row:
    variant = suite.variant[0].name
    clips = target.clips or tuple(clip.name for clip in suite.clip)
    own, other = (
        np.array([over_seeds(runs, whose or clip, variant, motion, target.score) for clip in clips])
        for motion, whose in ((target.of, None), (target.against, target.against_clip))
    )
    row: Row = {"text": target.text, "score": target.score}
    for level, bounds in (("must", target.must), ("reach", target.reach)):
        judged = [_judge(bound, own, other) for bound in bounds]
        known = [bound["met"] for bound in judged if bound["met"] is not None]
        row[level] = judged
        row[f"met_{level}"] = any(known) if known else None
    if np.isfinite(own).any():
        row["worst_clip"] = clips[int(np.nanargmax(own))]
    return row


def _judge(bound: Bound, own: np.ndarray[Any, Any], other: np.ndarray[Any, Any]) -> Row:
    """A bound's value over clips, and whether it is met."""
    both = np.isfinite(own) & np.isfinite(other) & (other > 0)
    known, ratios = own[np.isfinite(own)], own[both] / other[both]
    measures = {
        "mean": _mean(own),
        "worst": max(known, default=math.nan),
        "least": min(known, default=math.nan),
        "ratio": _mean(own[both]) / _mean(other[both]) if both.any() else math.nan,
        "worst_ratio": max(ratios, default=math.nan),
    }
    measured = float(measures[bound.measure])
    limits = [f"≤ {bound.at_most:g}"] if bound.at_most is not None else []
    limits += [f"≥ {bound.at_least:g}"] if bound.at_least is not None else []
    met = None
    if math.isfinite(measured):
        low = -math.inf if bound.at_least is None else bound.at_least
        high = math.inf if bound.at_most is None else bound.at_most
        met = bool(low <= measured <= high)
    return {
        "measure": bound.measure,
        "limit": " and ".join(limits),
        "value": measured if math.isfinite(measured) else None,
        "met": met,
    }


def _targets(rows: Sequence[Row]) -> list[str]:
    lines = ["| target | must | reach for | worst clip |", "|---|---|---|---|"]
    for target in rows:
        cells = [
            target["text"],
            _bounds(target, "must"),
            _bounds(target, "reach"),
            target.get("worst_clip", MISSING),
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def _checks(rows: Sequence[Row]) -> list[str]:
    lines = ["| what | measured | formula | error, % | must |", "|---|---|---|---|---|"]
    for check in rows:
        verdict = "**met**" if check["met"] else "**missed**"
        numbers = [f"{check[key]:.4g} {check['unit']}" for key in ("measured", "expected")]
        limit = f"{verdict} (≤ {check['within_pct']:g})"
        lines.append("| " + " | ".join([check["name"], *numbers, f"{check['error_pct']:.2f}", limit]) + " |")
    return lines


def _bounds(target: Row, level: str) -> str:
    if not target[level]:
        return MISSING
    parts = [f"{b['measure'].replace('_', ' ')} {_digits(b['value'])} ({b['limit']})" for b in target[level]]
    verdict = {True: "**met**", False: "**missed**", None: "not measured"}[target[f"met_{level}"]]
    return f"{verdict}: {', or '.join(parts)}"


def _digits(value: float | None) -> str:
    return MISSING if value is None else f"{value:.3g}"


def _table(suite: Suite, table: Table, runs: Sequence[Row]) -> list[str]:
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
        return _mean(over_seeds(runs, clip, variant, motion, score) for clip in clips)

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
    for column in table.columns:
        shown = [(motion, score(motion, column.score)) for motion in column.of]
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


def _made_on(content: Row) -> str:
    machine, versions = content["machine"], content["versions"]
    listed = ", ".join(f"{name} {version}" for name, version in versions.items() if version)
    memory = f", {machine['memory_GiB']} GiB" if machine.get("memory_GiB") else ""
    jobs = f"; {content['jobs']} runs at once" if content["jobs"] > 1 else ""
    return f"Made with {listed} on {machine['cores']} cores ({machine['processor']}{memory}){jobs}."


def _mean(values: Iterable[float]) -> float:
    known = [finite for finite in values if math.isfinite(finite)]
    return float(np.mean(known)) if known else math.nan


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else MISSING
