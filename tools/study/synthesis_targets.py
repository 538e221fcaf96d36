"""What the synthesis must reach, and whether it does: a table of docs/results/synthesis.md."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tools.study.synthesis_numbers import apart, ended, pair, values

NEAR = {"ade": 17.0, "fde": 11.0, "apd": 11.0}
"""How many percent worse than (a) a DLow trained on (b) may be: the figures of Xie 2021, table 5."""
SHARE_MIN, SPEED_MAX_S = 0.9, 0.2


def targets(known: dict[str, Any]) -> list[list[str]]:
    """Rows of the table: what, what it must be, what was measured, whether it is met."""
    return [
        [what, must, measured, "met" if met else "**missed**"]
        for rows in (_accuracy(known), _samplings(known), _uses(known))
        for what, must, measured, met in rows
    ]


Row = tuple[str, str, str, bool]


def _accuracy(known: dict[str, Any]) -> Iterator[Row]:
    for score in NEAR:
        verdict = apart(*pair(known, "dlow", "fit", score), score)
        said = verdict if verdict != "no" else "within the seeds' spread"
        yield (
            f"(b) against (c), {score.upper()}",
            "better, beyond the seeds' spread",
            said,
            verdict == "better",
        )
    for score, most in NEAR.items():
        ours, theirs = pair(known, "dlow", "truth", score)
        worse = 100 * float(ours.mean() / theirs.mean() - 1) * (-1 if score == "apd" else 1)
        said = f"{abs(worse):.1f} % {'worse' if worse > 0 else 'better'}"
        yield f"(b) against (a), {score.upper()}", f"at most {most:.0f} % worse", said, worse <= most


def _samplings(known: dict[str, Any]) -> Iterator[Row]:
    for score in ("ade", "apd"):
        one, other = (float(values(known, "simulation", name, score).mean()) for name in ("dlow", "cvae"))
        good = (one > other) == (score == "apd")
        yield f"DLow against cVAE on (b), {score.upper()}", "better", f"{one:.3f} and {other:.3f} m", good


def _uses(known: dict[str, Any]) -> Iterator[Row]:
    done, of = ended(known, balanced=True)
    said, good = f"{done} of {of}", of > 0 and done >= SHARE_MIN * of
    yield "simulated to the end, of those that start in balance", f"{SHARE_MIN:.0%} or more", said, good
    speed_s = known["speed_s"]
    yield "ten futures in NumPy", f"≤ {SPEED_MAX_S} s of one core", f"{speed_s:.3f} s", speed_s <= SPEED_MAX_S
    near_mm = 1e3 * float(values(known, "simulation", "dlow", "nearest_m").mean())
    true_mm = 1e3 * known["true_nearest"]["simulation"]
    must, said = "not nearer than that of what happened", f"{near_mm:.0f} and {true_mm:.0f} mm"
    yield "nearest training motion of a sample", must, said, near_mm >= true_mm
