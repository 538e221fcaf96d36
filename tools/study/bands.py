"""Whether the truth lies within the 90 % bands of pose and force, and the factors with which it does.

usage: python -m tools.study.bands --data DIR -o OUT [--clips NAME ...] [--plan NAME] [--seed N] [--threads N]

DIR is what `tools.make.possible` wrote. Each clip is reconstructed once (OUT/CLIP.npz is kept, and taken
from there again): what is saved are the spreads before any factor, and how far the truth is from the middle
of each band. A factor is the 90th percentile of the second over the first, over all frames of the other
clips; so the coverage of a clip is that of factors which have not seen it. Prints coverage and half widths by
clip, how often parts touch that are said to touch with some probability, and the factors of all clips for
`models/evidence/bands.toml`. Draws OUT/CLIP.png, vertical forces and their bands.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from simrecon import evidence as readers
from simrecon import plan as plans
from simrecon.bench import suite as suites
from simrecon.contact import rules
from simrecon.evidence import resample
from simrecon.io import npz
from simrecon.kinematics.spread import sight
from simrecon.metrics.truth import read_truth
from simrecon.pipeline import Reconstruction, Setup, reconstruct
from simrecon.replay import bands
from simrecon.system import blas
from simrecon.types import Array, Scene

SHARE = 0.9
KINDS = (
    "joints_across", "joints_along",
    "planned_all_horizontal", "planned_all_vertical", "planned_feet_horizontal", "planned_feet_vertical",
    "alone_all_horizontal", "alone_all_vertical", "alone_feet_horizontal", "alone_feet_vertical",
)  # fmt: skip
FORCES = {"all": [2], "feet": [0, 1]}
AXES = {"horizontal": [0, 1], "vertical": [2]}
EDGES = (0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 0.98)
"""Between classes of probability."""

Content = Mapping[str, Array]


def main(arguments: list[str] | None = None) -> None:
    """Reconstruct what is not there yet, and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", required=True, type=Path)
    parser.add_argument("-o", dest="output", required=True, type=Path)
    parser.add_argument("--clips", nargs="+")
    parser.add_argument("--plan", default="default")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, default=0)
    options = parser.parse_args(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    clips: dict[str, Content] = {}
    for clip in suites.read("possible").clip:
        if options.clips and clip.name not in options.clips:
            continue
        path = options.output / f"{clip.name}.npz"
        if not path.is_file():
            with blas.one_thread():
                made: dict[str, Any] = _measured(options.data, clip.name, options)
            np.savez_compressed(path, allow_pickle=False, **made)
            print(f"made {path}", flush=True)
        clips[clip.name] = npz.load(path).content
    if len(clips) > 1:
        print("\n".join(_said(clips)))
    for name, content in clips.items():
        _draw(content, options.output / f"{name}.png")


def _measured(data: Path, name: str, options: argparse.Namespace) -> dict[str, Array]:
    """Spreads and errors of a clip."""
    evidence = readers.read(data / "evidence" / f"{name}.npz")
    plan = plans.read(options.plan)
    setup = Setup(planner=plan.planner, seed=options.seed, threads=options.threads)
    run = reconstruct(evidence, Scene(), plan, setup)
    return spreads(run, data / "truth" / f"{name}.npz")


def spreads(run: Reconstruction, truth_file: Path) -> dict[str, Array]:
    """What the bands of a run are made of, and the truth at its frames.

    Returns:
        `times_s` (T,), `weight_N`, `across_m`, `along_m`, `off_m` (T, M, 3), `sight` (T, 1, 3),
        `centre_planned_N`, `sigma_planned_N`, `centre_alone_N`, `sigma_alone_N`, `truth_N`, `own_N`
        (T, 3, 3) of left foot, right foot and all, `touch`, `touches` (T, 2).
    """
    truth, motion = read_truth(truth_file), run.motion
    columns = [truth.joint_names.index(name) for name in motion.joint_names]
    if truth.pushes is None or run.fit.spread_m is None:
        raise SystemExit(f"{truth_file}: found no forces; valid: a truth that was simulated")
    grid = resample(run.evidence)[1]
    across, along = run.fit.spread_m[:, grid]
    parts = truth.pushes.on(motion.contact_body)
    feet = bands.feet_of(run.fit.body)
    found = {
        "times_s": motion.times_s,
        "weight_N": np.array(bands.GRAVITY_MPS2 * run.fit.body.mass_kg),
        "across_m": across,
        "along_m": along,
        "off_m": motion.joints_m - truth.joints_m[:, columns],
        "sight": sight(motion.joints_m, run.fit.camera),
        "truth_N": bands.shown(parts, run.fit.body),
        "own_N": bands.shown(motion.contact_force_N, run.fit.body),
    }
    bare = replace(run.reference, contact_force_N=None)
    for word, reference in (("planned", run.reference), ("alone", bare)):
        known = bands.forces(motion, run.problem, run.fit.body, reference, run.windows, grid)
        if known is None:
            raise SystemExit(f"{truth_file}: found no spread of forces; valid: a plan with draws")
        found |= {f"centre_{word}_N": known.centre_N, f"sigma_{word}_N": known.sigma_N}
        if word == "planned":
            found["touch"] = np.stack([known.touch[:, own].max(axis=1) for own in feet], axis=1)
    pushed = rules.loaded(np.linalg.norm(parts, axis=-1))
    found["touches"] = np.stack([pushed[:, own].any(axis=1) for own in feet], axis=1)
    return found


def ratios(content: Content) -> dict[str, Array]:
    """How many spreads the truth is from the middle, by `KINDS`; those of each frame and component."""
    line = content["sight"]
    along = (content["off_m"] * line).sum(axis=-1, keepdims=True) * line
    found = {
        "joints_across": np.abs(content["off_m"] - along) / np.maximum(content["across_m"], 1e-6),
        "joints_along": np.linalg.norm(along, axis=-1)
        / np.maximum(np.linalg.norm(content["along_m"], axis=-1), 1e-6),
    }
    for word in ("planned", "alone"):
        off = np.abs(content["truth_N"] - content[f"centre_{word}_N"]) / content[f"sigma_{word}_N"]
        known = np.isfinite(off[:, 0, 0])
        for who, rows in FORCES.items():
            for axis, places in AXES.items():
                found[f"{word}_{who}_{axis}"] = off[known][:, rows][:, :, places]
    return found


def factors(clips: Mapping[str, Content]) -> dict[str, float]:
    """With which the truth lies within in `SHARE` of all frames."""
    each = [ratios(content) for content in clips.values()]
    return {
        kind: float(np.quantile(np.concatenate([own[kind].ravel() for own in each]), SHARE)) for kind in KINDS
    }


def covered(content: Content, by: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """Share of frames and components within bands of some factors; mean half width, m or % of body weight."""
    half = np.hypot(by["joints_across"] * content["across_m"], by["joints_along"] * content["along_m"])
    found = {"joints": (float((np.abs(content["off_m"]) <= half).mean()), float(half.mean()))}
    own = ratios(content)
    for kind in KINDS[2:]:
        word, who, axis = kind.split("_")
        sigma = content[f"sigma_{word}_N"][1:][:, FORCES[who]][:, :, AXES[axis]]
        width = by[kind] * np.nanmean(sigma) / content["weight_N"]
        found[kind] = float((own[kind] <= by[kind]).mean()), float(100.0 * width)
    return found


def _said(clips: Mapping[str, Content]) -> list[str]:
    """Coverage of each clip by the factors of the others, and all that follows."""
    rows = {}
    for name, content in clips.items():
        others = {other: one for other, one in clips.items() if other != name}
        rows[name] = covered(content, factors(others))
    names = list(next(iter(rows.values())))
    lines = ["| clip | " + " | ".join(name.replace("_", " ") for name in names) + " |"]
    lines.append("|---" * (len(names) + 1) + "|")
    for name, row in rows.items():
        lines.append(f"| {name} | " + " | ".join(f"{100 * row[key][0]:.0f}" for key in names) + " |")
    for word, value in (("mean", np.mean), ("least", np.min), ("most", np.max)):
        shares = [f"{100 * value([row[key][0] for row in rows.values()]):.1f}" for key in names]
        lines.append(f"| {word} | " + " | ".join(shares) + " |")
    within = [sum(0.8 <= row[key][0] <= 0.97 for row in rows.values()) for key in names]
    lines.append("| clips of 80 to 97 % | " + " | ".join(map(str, within)) + " |")
    widths = [np.mean([row[key][1] for row in rows.values()]) for key in names]
    shown = [f"{1e3 * widths[0]:.0f} mm", *(f"{width:.1f} % of weight" for width in widths[1:])]
    lines += ["| half width | " + " | ".join(shown) + " |", "", *_touching(clips), ""]
    lines += [f"{kind} = {value:.3g}" for kind, value in factors(clips).items()]
    return lines


def _touching(clips: Mapping[str, Content]) -> list[str]:
    """How often feet touch that are said to with some probability."""
    said = np.concatenate([content["touch"][1:].ravel() for content in clips.values()])
    true = np.concatenate([content["touches"][1:].ravel() for content in clips.values()])
    known = np.isfinite(said)
    said, true = said[known], true[known].astype(float)
    sure = np.where(said > SHARE, true, np.where(said < 1 - SHARE, 1 - true, 1.0))
    lines = ["| said | touches | frames |", "|---|---|---|"]
    classes = np.digitize(said, EDGES)
    for row in range(len(EDGES) + 1):
        own = classes == row
        if own.any():
            lines.append(f"| {said[own].mean():.2f} | {true[own].mean():.2f} | {own.sum()} |")
    undecided = np.mean((said >= 1 - SHARE) & (said <= SHARE))
    brier = np.mean((said - true) ** 2)
    return [
        *lines,
        f"Brier score {brier:.3f}; within {100 * sure.mean():.1f} %, undecided {100 * undecided:.1f} %",
    ]


def _draw(content: Content, path: Path) -> None:
    """Vertical force of left foot, right foot and all with its band, per cent of body weight."""
    from matplotlib.figure import Figure

    told, share = bands.calibration().planned, 100.0 / content["weight_N"]
    figure = Figure(figsize=(8, 6), layout="constrained")
    times = content["times_s"] - content["times_s"][0]
    names = ("left foot", "right foot", "all contacts")
    for row, (name, axes) in enumerate(zip(names, figure.subplots(3, 1, sharex=True), strict=True)):
        factor = told.all_vertical if row == 2 else told.feet_vertical
        middle, half = (content[f"{word}_planned_N"][:, row, 2] for word in ("centre", "sigma"))
        low, high = np.maximum(middle - factor * half, 0.0), middle + factor * half
        axes.fill_between(times, share * low, share * high, alpha=0.25, lw=0, label="90 % band")
        axes.plot(times, share * content["truth_N"][:, row, 2], "k", lw=1, label="truth")
        axes.plot(times, share * content["own_N"][:, row, 2], lw=0.8, label="simulation")
        axes.set(ylabel=f"{name}, %")
    axes.set(xlabel="time, s")
    axes.legend(fontsize=7)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
