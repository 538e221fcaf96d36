"""Scores of several motions of a clip as a table: for JSON, and as text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from simrecon.evaluation.comparison import Comparison
from simrecon.metrics import statistics
from simrecon.metrics.definitions import DEFINITIONS, GROUPS
from simrecon.metrics.statistics import Scores

SCHEMA = "simrecon.scores/1"
RESULT, KINEMATIC, PLAN, INPUT, REFERENCE = "result", "kinematic", "plan", "input", "reference"


@dataclass(frozen=True, eq=False)
class Table:
    """Scores by motion and name.

    Attributes:
        values: by motion (`result`, `kinematic`, `plan`, `input`, peers by name, `reference`) and score.
        intervals: the same, of scores that are means over frames: lower and upper limit.
        bootstrap: how the intervals were made.
    """

    values: dict[str, dict[str, float]]
    intervals: dict[str, dict[str, tuple[float, float]]] = field(default_factory=dict)
    bootstrap: dict[str, float] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """For JSON: one entry by motion, then `intervals` and `bootstrap`."""
        return {
            "schema": SCHEMA,
            **self.values,
            "intervals": {name: {k: list(v) for k, v in row.items()} for name, row in self.intervals.items()},
            "bootstrap": self.bootstrap,
        }


def make(first: str, scores: Mapping[str, Scores], on: Comparison, seed: int | None) -> Table:
    """The table of scores by motion.

    Args:
        first: motion whose row says what share of the reference is covered.
        scores: by motion.
        on: what the motions were compared on.
        seed: of the bootstrap; None leaves the intervals out.
    """
    values = {name: row.values for name, row in scores.items()}
    values[first] = {"covered": len(on.times_s) / len(on.truth.times_s)} | values[first]
    if seed is None:
        return Table(values)
    limits = {
        name: statistics.intervals(row.series, float(np.ptp(on.times_s)), seed=seed)
        for name, row in scores.items()
    }
    known = {
        name: {key: pair for key, pair in row.items() if np.isfinite(pair).all()}
        for name, row in limits.items()
    }
    how = {"seed": seed, "samples": statistics.SAMPLES, "block_s": statistics.BLOCK_S}
    return Table(values, known, how | {"level": statistics.LEVEL})


def text(table: Table) -> str:
    """Scores as aligned text: a line for each score, a column for each motion, and the definition."""
    columns = list(table.values)
    lines = [["", *columns, "[result]" if table.bootstrap else "", ""]]
    for group, names in GROUPS.items():
        shown = [name for name in names if any(name in table.values[column] for column in columns)]
        if shown:
            lines += [[""] * (len(columns) + 3), [group, *[""] * (len(columns) + 2)]]
            lines += [_line(name, table, columns) for name in shown]
    widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
    widths[0] = max(map(len, DEFINITIONS))
    body = [
        "  ".join([line[0].ljust(widths[0]), *map(str.rjust, line[1:-1], widths[1:-1]), line[-1]]).rstrip()
        for line in lines
    ]
    if not table.bootstrap:
        return "\n".join(body)
    how = table.bootstrap
    note = (
        f"[ ] {100 * how['level']:.0f} % interval of the result: {how['samples']:.0f} resamples of frames "
        f"in blocks of {how['block_s']:g} s, seed {how['seed']:.0f}"
    )
    return "\n".join([*body, "", note])


def _line(name: str, table: Table, columns: list[str]) -> list[str]:
    cells = [number(table.values[column].get(name)) for column in columns]
    pair = table.intervals.get(RESULT, {}).get(name)
    limits = "" if pair is None else f"[{number(pair[0])}, {number(pair[1])}]"
    return [name, *cells, limits, DEFINITIONS[name]]


def number(value: float | None) -> str:
    """A number of three digits, or all of its whole ones; `-` for none."""
    if value is None:
        return "-"
    if value == 0 or abs(value) < 1e-9:
        return "0"
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"
