"""Why a simulation rocks from foot to foot where both stand: forces of each foot, heels and toes, over time.

usage: python -m tools.study.standing --data DATA -o OUT [--clips FOLDER] [--plan NAME] [--threads N]
                                      [--ways NAME ...] [--only NAME ...]

DATA holds `grf/opencap_subject4`: the squat of the suite `force`, its first 4.5 s. FOLDER is what
`tools.make.possible` wrote: slow motions with both feet on the floor, seen by the camera. Each is simulated
with the plan, and with what a way changes in it; results that are there are kept. Prints a table and draws
OUT/CASE.png. Forces are per cent of body weight. A foot's *asked* share is what the fit asks for: the point
on the floor about which its inertial and gravitational forces have no moment, on the line between the feet's
middles.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import savgol_filter

import simrecon
from simrecon import evidence as readers
from simrecon import plan as plans
from simrecon import planners
from simrecon.bench import plates
from simrecon.body.primitives import FEET
from simrecon.evaluation import scores, simulated
from simrecon.evaluation.simulated import Simulated
from simrecon.job import Job
from simrecon.metrics.dynamics import GRAVITY_MPS2, UP_MPS2, body_weight_pct
from simrecon.metrics.filters import low_pass
from simrecon.metrics.rates import at
from simrecon.metrics.truth import Truth, read_truth
from simrecon.results import kinematic
from simrecon.types import Array
from tools.study import feasibility, levelled

SPAN_S, EVERY, MASS_KG = (0.0, 4.5), 3, 60.1
SLOW_HZ, LIFTED_PCT = 2.0, 5.0
"""What is faster is rocking; a foot under less hangs."""
POINTS = ("left_heel", "left_toe", "right_heel", "right_toe")
MARKERS = {"kinematics.joint_scale_m": 0.02, "kinematics.place_scale_m": 0.02}
LEVEL = "soles level"
WAYS: dict[str, dict[str, Any]] = {
    "as the plan": {},
    "velocities ×10": {"loss.landmark_velocity": 5.0},
    "velocities ×30": {"loss.landmark_velocity": 15.0},
    "joints ×10": {"loss.pose": 5.0},
    "step 4.2 ms": {"simulation.timestep_max_s": 0.0042},
    LEVEL: {},
}


@dataclass(frozen=True)
class Case:
    """A clip: evidence, reference with forces, and what of the plan its suite changes."""

    name: str
    evidence: Path
    truth: Path
    changes: dict[str, Any]


@dataclass(frozen=True, eq=False)
class Signals:
    """What a result shows over its T frames: vertical forces (T, 2) of left and right foot, % of weight.

    Attributes:
        times_s: (T,). true_pct, own_pct, asked_pct: of the reference, of the simulation, of the fit.
        true_m, fit_m, own_m: (T, 4) heights of heels and toes (`POINTS`) over where they rest.
    """

    times_s: Array
    true_pct: Array
    own_pct: Array
    asked_pct: Array
    true_m: Array
    fit_m: Array
    own_m: Array


def main() -> None:
    """Print a table, draw a figure for each clip."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--clips", type=Path, help="folder of tools.make.possible")
    parser.add_argument("-o", dest="output", type=Path, required=True)
    parser.add_argument("--plan", default="default")
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=list(WAYS))
    parser.add_argument("--only", nargs="+", default=["squat_plates"], metavar="CASE")
    options = parser.parse_args()
    planners.PLANNERS["levelled"] = levelled.plan
    print(
        "| clip | way | MPJPE-G, mm | foot slide, fit → own (truth), m/s | total MAE | one foot MAE ", end=""
    )
    print("| of it slow | rocking, RMS | asked, MAE | a foot hangs, % |\n" + "|---" * 10 + "|")
    for case in cases(options.data, options.clips, options.output, options.only):
        drawn = {}
        for way in options.ways:
            folder = options.output / f"{case.name}-{way.replace(' ', '_')}"
            if not (folder / "motion.npz").is_file():
                plan = plans.overridden(plans.read(options.plan), case.changes | WAYS[way], way)
                planner = "levelled" if way == LEVEL else "none"
                job = Job(str(case.evidence), str(folder), plan=plan, planner=planner)
                simrecon.run(job, threads=options.threads)
            drawn[way] = signals(folder, read_truth(case.truth))
            print(row(case, way, folder, drawn[way]), flush=True)
        draw(drawn, options.output / f"{case.name}.png")


def cases(data: Path, clips: Path | None, output: Path, only: list[str]) -> Iterator[Case]:
    """The squat of the suite `force`, and clips of the suite `possible`."""
    for name in only:
        if name == "squat_plates":
            yield _squat(data / "grf" / "opencap_subject4", output)
        elif clips is not None:
            yield Case(name, clips / "evidence" / f"{name}.npz", clips / "truth" / f"{name}.npz", {})


def _squat(trials: Path, output: Path) -> Case:
    """The first squats, at a third of the markers' 100 frames a second."""
    folder = output / "squat_plates"
    folder.mkdir(parents=True, exist_ok=True)
    files = [trials / name for name in ("squatsAsym1.trc", "static1.trc", "squatsAsym1_grf.mot")]
    seen, truth = plates.make(
        folder, *files, mass_kg=MASS_KG, cutoff_hz=4.0, feet_on_plates=True, span_s=SPAN_S
    )
    readers.write(seen, readers.within(readers.read(seen), readers.Span(every=EVERY), str(seen)))
    return Case("squat_plates", seen, truth, MARKERS)


def signals(folder: Path, truth: Truth) -> Signals:
    """What a result shows."""
    result = simulated.read(folder)
    motion, times = result.motion, result.motion.times_s
    columns = [motion.contact_body.index(foot) for foot in FEET]
    own = body_weight_pct(motion.contact_force_N[:, columns, 2], result.mass_kg)
    force, when = np.zeros((len(truth.times_s), 2, 3)), times
    if truth.pushes is not None:
        force = truth.pushes.on(FEET)
    elif truth.plates is not None:
        force, when = truth.plates.force_N, times - 0.5 * np.diff(times, prepend=times[0])
    true = body_weight_pct(at(when, truth.times_s, force), truth.mass_kg or result.mass_kg)[..., 2]
    shapes = [result.body, result.kinematic or result.body]
    own_m, fit_m = (_heights(result, shape.points_m, motion.joint_names) for shape in shapes)
    true_m = _heights(result, at(times, truth.times_s, truth.joints_m), truth.joint_names)
    return Signals(times, true, own, _asked(folder, result), true_m, fit_m, own_m)


def _heights(result: Simulated, points_m: Array, names: tuple[str, ...]) -> Array:
    """Heights (T, 4) of heels and toes over the height at which those of the body rest."""
    columns = [names.index(point) for point in POINTS]
    return np.asarray(points_m[:, columns, 2] - np.array([result.rest_m[point] for point in POINTS]))


def _asked(folder: Path, result: Simulated) -> Array:
    """Vertical force (T, 2) that the fit asks of each foot, % of body weight."""
    fit = kinematic.read(folder)[1]
    com_m, momentum = feasibility.motion_of_mass(fit)
    smooth = {"window_length": feasibility.SMOOTH, "polyorder": 3, "axis": 0}
    interval_s = float(fit.times_s[1] - fit.times_s[0])
    acceleration = savgol_filter(com_m, deriv=2, delta=interval_s, **smooth) + UP_MPS2
    turning = savgol_filter(momentum, deriv=1, delta=interval_s, **smooth) / result.mass_kg
    upward = acceleration[:, 2:]
    zero = com_m[:, :2] - (com_m[:, 2:] * acceleration[:, :2] + turning[:, 1::-1] * [1.0, -1.0]) / upward
    zero = at(result.motion.times_s, fit.times_s, zero)
    shape = result.kinematic or result.body
    soles = shape.corners_m[..., :2].reshape(len(zero), 2, 4, 2).mean(axis=2)  # (T, 2, 2)
    across = soles[:, 0] - soles[:, 1]
    left = np.clip(((zero - soles[:, 1]) * across).sum(1) / (across**2).sum(1), 0.0, 1.0)
    total = 100.0 * at(result.motion.times_s, fit.times_s, upward)[:, 0] / GRAVITY_MPS2
    return np.asarray(total[:, None] * np.stack([left, 1.0 - left], axis=1))


def row(case: Case, way: str, folder: Path, found: Signals) -> str:
    """A line of the table; the first frame, which holds the force of an instant, is left out."""
    values = scores.score(folder, case.truth, case.evidence, seed=None).values
    own, fit = values["result"], values["kinematic"]
    true, ours, asked = (x[1:] for x in (found.true_pct, found.own_pct, found.asked_pct))
    interval_s = float(np.median(np.diff(found.times_s)))
    error = ours - true
    slow = low_pass(error, interval_s, SLOW_HZ)
    cells = [
        case.name,
        way,
        f"{own['mpjpe_g_mm']:.1f}",
        f"{fit['foot_slide_mps']:.3f} → {own['foot_slide_mps']:.3f} ({own['foot_slide_truth_mps']:.3f})",
        f"{np.abs(error.sum(1)).mean():.1f}",
        f"{np.abs(error).mean():.1f}",
        f"{np.abs(slow).mean():.1f}",
        f"{np.sqrt(np.square(error - slow).mean()):.1f}",
        f"{np.abs(asked - true).mean():.1f}",
        f"{100 * (ours < LIFTED_PCT).any(1).mean():.0f} ({100 * (true < LIFTED_PCT).any(1).mean():.0f})",
    ]
    return "| " + " | ".join(cells) + " |"


def draw(drawn: dict[str, Signals], path: Path) -> None:
    """Force and heights of each foot over time, a column of panels for each way."""
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(4, len(drawn), figsize=(5.2 * len(drawn), 9.5), sharex=True, squeeze=False)
    for column, (way, found) in enumerate(drawn.items()):
        axes[0, column].set_title(way)
        for foot, side in enumerate(("left", "right")):
            panel = axes[foot, column]
            for name, values in (("truth", found.true_pct), ("asked by the fit", found.asked_pct)):
                panel.plot(found.times_s[1:], values[1:, foot], lw=1.4, label=name)
            panel.plot(found.times_s[1:], found.own_pct[1:, foot], lw=1.0, label="simulated")
            panel.set(ylabel=f"{side} foot, % of weight", ylim=(-5, 135))
            low = axes[2 + foot, column]
            for point, shade in ((2 * foot, "tab:red"), (2 * foot + 1, "tab:blue")):
                end = POINTS[point].split("_")[1]
                shown = {"truth": (":", found.true_m), "fit": ("--", found.fit_m), "own": ("-", found.own_m)}
                for name, (style, heights_m) in shown.items():
                    low.plot(found.times_s, 1e3 * heights_m[:, point], style, c=shade, label=f"{end}, {name}")
            low.set(ylabel=f"{side} foot, mm over the floor", ylim=(-15, 60))
        axes[3, column].set_xlabel("s")
    for panel in axes.ravel():
        panel.grid(alpha=0.3)
    axes[0, 0].legend(fontsize=7)
    axes[2, 0].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=80)
    pyplot.close(figure)


if __name__ == "__main__":
    main()
