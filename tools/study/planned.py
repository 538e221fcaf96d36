"""What a planner makes of kinematic fits, without simulation: tables 2 and 3 of Rempe 2020, and the cost.

usage: python -m tools.study.planned DATA [--planner centroidal] [--clips NAME ...] [--contacts network]
           [--floor fitted]

DATA holds `evidence` and `truth`. The fit is that of plan `quick`. Forces of the fit are those that its
joints ask for, forces of the plan its own. Flight and contacts are those of the truth, and heights are over
the person's own sole. Each cell: fit → plan.
The last row has means over clips. With `--floor fitted` the fit has to find the floor as well, and heights
are those over it (tables E3 and E4).
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from simrecon import evidence as readers
from simrecon import kinematics, plan, planners, scene
from simrecon.evaluation.accuracy import accuracy
from simrecon.evaluation.comparison import Comparison, Track, comparison, track
from simrecon.evaluation.configurations import foot_rest
from simrecon.evaluation.fitted import TIMESTEP_S
from simrecon.evaluation.plausibility import plausibility
from simrecon.evidence import resample
from simrecon.kinematics import world
from simrecon.metrics import dynamics
from simrecon.metrics.rates import at, covered_times
from simrecon.metrics.truth import read_truth
from simrecon.sim.models import compile_foreign
from simrecon.types import KinematicFit, Reference, Scene

FORCES = ("implied_grf_mean_pct", "implied_grf_max_pct", "implied_grf_ballistic_pct")
FEET = ("floating_rempe_pct", "penetration_rempe_pct", "skate_rempe_pct")
PLACES = ("feet_mm", "mpjpe_g_mm", "mpjpe_g_align1_mm")
ENDS = ("left_ankle", "right_ankle", "left_toe", "right_toe")
HEAD = (
    "clip", "mean GRF, %", "max GRF, %", "ballistic GRF, %", "floating, %", "penetration, %", "skate, %",
    "feet, mm", "body, mm", "body, first frame aligned, mm", "unexplained force, %", "processor s per s",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Clip:
    """One clip: scores of fit and plan, what of the plan is unexplained, and the cost per second."""

    name: str
    before: Mapping[str, float]
    after: Mapping[str, float]
    unexplained_pct: float
    cost: float
    notes: tuple[str, ...]


def main() -> None:
    """Print the table, its means, and what the planner says."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("data", type=Path)
    parser.add_argument("--planner", default="centroidal", choices=planners.names())
    parser.add_argument("--clips", nargs="+")
    parser.add_argument("--contacts", default="rules", choices=plan.CONTACTS)
    parser.add_argument("--floor", default="true", choices=("true", "fitted"))
    options = parser.parse_args()
    settings = plan.overridden(plan.read("quick"), {"kinematics.contact_model": options.contacts}, "study")
    names = options.clips or sorted(path.stem for path in (options.data / "truth").glob("*.npz"))
    print("| " + " | ".join(HEAD) + " |\n" + "|---" * len(HEAD) + "|")
    clips = []
    for name in names:
        clips.append(measured(options.data, name, options.planner, settings, options.floor == "true"))
        print(row(clips[-1]), flush=True)
    print(row(mean(clips)))
    broken = [clip for clip in clips if any("no plan" in note or "converge" in note for note in clip.notes)]
    print(f"\n{len(clips) - len(broken)} of {len(clips)} plans keep all constraints.\n")
    for clip in clips:
        for note in clip.notes:
            print(f"- {clip.name}: {note}")


def measured(data: Path, name: str, planner: str, settings: plan.Plan, floor: bool) -> Clip:
    """A clip of a folder, planned; `floor`: whether the fit is told where it is."""
    seen, _ = resample(readers.read(data / "evidence" / f"{name}.npz"))
    seen = replace(seen, ground_known=seen.ground_known and floor)
    fit = kinematics.fit(seen, Scene(), settings.kinematics)
    fit = fit if floor else world.placed(fit, seen.camera)
    start = time.process_time()
    found = planners.plan(planner, fit, seen, settings)
    cost = (time.process_time() - start) / float(fit.times_s[-1] - fit.times_s[0])
    truth = read_truth(data / "truth" / f"{name}.npz")
    target = track(truth.times_s, truth.joint_names, truth.joints_m, "reference")
    on = comparison(target, covered_times(fit.times_s, target.times_s), fit.scene, pushes=truth.pushes)
    before, after = (scores(fit, qpos, on) for qpos in (fit.qpos, found.qpos))
    wrench = np.zeros((1, 6)) if found.root_wrench is None else found.root_wrench
    force = dynamics.body_weight_pct(np.linalg.norm(wrench[:, :3], axis=1), fit.body.mass_kg)
    return Clip(
        name, before, {**after, **pushed(fit, found, on)}, float(np.percentile(force, 95)), cost, found.notes
    )


def mean(clips: list[Clip]) -> Clip:
    """Means of what is known of clips; the largest force is the mean of their largest, too."""

    def over(side: str) -> dict[str, float]:
        tables = [getattr(clip, side) for clip in clips]
        return {
            name: float(np.nanmean([table.get(name, np.nan) for table in tables]))
            for name in (*FORCES, *FEET, *PLACES)
            if any(np.isfinite(table.get(name, np.nan)) for table in tables)
        }

    unexplained, cost = (
        float(np.mean([getattr(c, key) for c in clips])) for key in ("unexplained_pct", "cost")
    )
    return Clip("mean", over("before"), over("after"), unexplained, cost, ())


def scores(fit: KinematicFit, qpos: np.ndarray, on: Comparison) -> dict[str, float]:
    """Of joint configurations (T, nq) of the person."""
    marks = kinematics.configurations(fit.body, qpos)[1]
    model = compile_foreign(scene.build(fit.body.mjcf, fit.scene, TIMESTEP_S), "body")
    own = track(fit.times_s, fit.body.skeleton.point_names, marks, "motion", foot_rest(model))
    values = (accuracy(own, on) | plausibility(own, on)).values
    return {**values, "feet_mm": feet_mm(own, on)}


def feet_mm(motion: Track, on: Comparison) -> float:
    """Mean distance of ankles and toes from the reference's, mm."""
    names = [name for name in ENDS if name in on.truth.names]
    off = motion.at(on.times_s, names) - on.truth.at(on.times_s, names)
    return 1e3 * float(np.linalg.norm(off, axis=2).mean())


def pushed(fit: KinematicFit, found: Reference, on: Comparison) -> dict[str, float]:
    """Forces of a plan; none where it has none."""
    if found.contact_force_N is None:
        return {}
    norm = dynamics.grf_norm_pct(found.contact_force_N.sum(axis=1), fit.body.mass_kg)  # (T,)
    flight = at(fit.times_s, on.times_s, on.flight.astype(np.float64)) > 0.5
    ballistic = dynamics.ballistic_grf_pct(norm, flight)
    return dict(zip(FORCES, (float(norm.mean()), float(norm.max()), ballistic), strict=True))


def row(clip: Clip) -> str:
    """Of the table."""
    cells = []
    for name in (*FORCES, *FEET, *PLACES):
        digits = 0 if name.endswith(("max_pct", "mm")) else 1
        pair = (values.get(name, float("nan")) for values in (clip.before, clip.after))
        cells.append(" → ".join("–" if np.isnan(value) else f"{value:.{digits}f}" for value in pair))
    return f"| {clip.name} | " + " | ".join(cells) + f" | {clip.unexplained_pct:.0f} | {clip.cost:.1f} |"


if __name__ == "__main__":
    main()
