"""Vertical force over time: what was planned, what was simulated after it, and the truth's.

    python -m tools.study.plan_forces --clips FOLDER --simulated OUT --planned OUT
                                      [--only NAME ...] -o FILE

FOLDER is that of `tools.make.possible`; OUT are those of the suites `possible` and `plans_possible`, whose
results this reads. Shares of body weight, means over a frame, then over three of them, on all three curves.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simrecon.evaluation import simulated
from simrecon.metrics.dynamics import body_weight_pct
from simrecon.metrics.rates import at
from simrecon.metrics.truth import Truth, read_truth
from simrecon.types import Array

SMOOTHED = np.ones(3) / 3
ENDS = 3
"""Frames at either end that the smoothing, and the first step of a simulation, spoil."""


@dataclass(frozen=True, eq=False)
class Curves:
    """Vertical force (T,), % of body weight, of one clip."""

    name: str
    times_s: Array
    true: Array
    planned: Array
    simulated: Array

    def error(self, values: Array) -> tuple[float, float]:
        """Mean absolute error, % of body weight, and the correlation, of one of them."""
        inner = slice(ENDS, -ENDS)
        off = np.abs(values - self.true)[inner].mean()
        return float(off), float(np.corrcoef(values[inner], self.true[inner])[0, 1])


def main() -> None:
    """Print errors of both, draw a panel for each clip."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--clips", type=Path, required=True)
    parser.add_argument("--simulated", type=Path, required=True)
    parser.add_argument("--planned", type=Path, required=True)
    parser.add_argument("--only", nargs="+", default=["squat", "walk", "kick", "jump_tall", "jog", "getup"])
    parser.add_argument("-o", dest="output", type=Path, required=True)
    options = parser.parse_args()
    drawn = []
    print("| clip | planned, % of body weight, correlation | simulated |\n|---|---|---|")
    for name in options.only:
        truth = read_truth(options.clips / "truth" / f"{name}.npz")
        found = curves(name, truth, *(_folder(path, name) for path in (options.planned, options.simulated)))
        errors = [found.error(values) for values in (found.planned, found.simulated)]
        print(f"| {name} | " + " | ".join(f"{off:.1f}, {same:.2f}" for off, same in errors) + " |")
        drawn.append(found)
    draw(drawn, options.output)


def _folder(suite: Path, name: str) -> Path:
    """The result of a clip in the folder of a suite: that of its first variant and seed."""
    return next(iter(sorted(path.parent for path in (suite / "runs" / name).glob("**/motion.npz"))))


def curves(name: str, truth: Truth, planned: Path, followed: Path) -> Curves:
    """The three curves on the frames of the simulation."""
    if truth.pushes is None:
        raise ValueError(f"{name}: its truth knows no forces")
    after, before = simulated.read(followed), simulated.read(planned)
    times_s = after.motion.times_s

    def share(own_s: Array, force_N: Array, mass_kg: float) -> Array:
        force = body_weight_pct(at(times_s, own_s, force_N[:, None]), mass_kg)[:, 0]
        return np.convolve(force, SMOOTHED, "same")

    own_kg = truth.mass_kg or after.mass_kg
    return Curves(
        name,
        times_s,
        share(truth.times_s, truth.pushes.force_N[..., 2].sum(axis=1), own_kg),
        share(before.motion.times_s, before.motion.grf_N[:, 2], before.mass_kg),
        share(times_s, after.motion.grf_N[:, 2], after.mass_kg),
    )


def draw(drawn: list[Curves], path: Path) -> None:
    """Two panels a row."""
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(-(-len(drawn) // 2), 2, figsize=(10.4, 1.3 * len(drawn)), squeeze=False)
    for panel, found in zip(axes.ravel(), drawn, strict=False):
        inner = slice(1, -1)
        for label, values, style in (
            ("truth", found.true, {"c": "0.35", "lw": 2.2}),
            ("planned", found.planned, {"c": "tab:orange", "lw": 1.3}),
            ("simulated", found.simulated, {"c": "tab:blue", "lw": 1.3}),
        ):
            panel.plot(found.times_s[inner], values[inner], label=label, **style)
        panel.set(title=found.name, ylabel="% of body weight")
        panel.grid(alpha=0.3)
    axes[0, 0].legend(fontsize=8)
    for panel in axes[-1]:
        panel.set_xlabel("s")
    figure.tight_layout()
    figure.savefig(path, dpi=80)
    pyplot.close(figure)


if __name__ == "__main__":
    main()
