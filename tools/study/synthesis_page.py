"""docs/results/synthesis.md, made of what `tools.study.synthesis` measured."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np

from simrecon.types import Array
from tools.study import synthesis_targets
from tools.study.synthesis_numbers import apart, ended, interval, pair, values
from tools.train.synthesis_corpus import KINDS

COMMANDS = """\
    python -m tools.train.reconstruct_corpus --data DATA -o corpus --seconds {seconds}  # extra [batch]
    python -m tools.train.synthesis corpus                              # extra [train]
    python -m tools.study.synthesis corpus --work work                  # writes this page
"""
TITLES = {
    "truth": "(a) recordings",
    "simulation": "(b) simulated",
    "fit": "(c) kinematic",
    "half": "(a), every second motion",
}
SAMPLERS = {"cvae": "cVAE", "dlow": "DLow"}
SCORES = {"ade": "ADE, m ↓", "fde": "FDE, m ↓", "apd": "APD, m ↑"}
LOOKS = {"skate": "foot skate, %", "penetration": "penetration, %", "floating": "floating, %"}
DISTANCES = {
    "fit_mpjpe_g_mm": "fit, MPJPE-G, mm",
    "simulation_mpjpe_g_mm": "simulation, MPJPE-G, mm",
    "fit_mpjpe_mm": "fit, MPJPE, mm",
    "simulation_mpjpe_mm": "simulation, MPJPE, mm",
}


def page(known: dict[str, Any]) -> str:
    """The whole page."""
    seconds = round(max(clip["seconds"] for clip in known["clips"]))
    target_head = ["what", "must", "measured", ""]
    parts = [
        "# Results: synthesis of futures\n",
        intro(known),
        COMMANDS.format(seconds=seconds),
        f"## What is learned from\n\n{corpus(known)}",
        f"## Table 5 of Xie 2021\n\n{scores(known)}",
        f"## (b) against (c), and against (a)\n\n{against(known)}",
        f"## Why the difference is what it is\n\n{why(known)}",
        f"## Beyond the paper\n\n{looks(known)}",
        f"## Targets\n\n{table(target_head, synthesis_targets.targets(known))}",
    ]
    return "\n".join(parts)


def paragraph(text: str) -> str:
    """Text in lines of the documentation's width."""
    return textwrap.fill(" ".join(text.split()), 120, break_on_hyphens=False) + "\n"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)]) + "\n"


def intro(known: dict[str, Any]) -> str:
    """What was done."""
    windows, motions = known["tests"]
    return paragraph(
        f"""The method is in [what follows](../synthesis.md). Motion capture is seen by a virtual camera
        with a pose network's errors and reconstructed with the plan `quick`; the same model is trained
        on (a) the recordings, (b) the simulated motions and (c) the kinematic fits, of the same frames,
        and tested on {windows} windows of {motions} recordings that none has seen."""
    )


def corpus(known: dict[str, Any]) -> str:
    """How far fit and simulation are from the recordings."""
    rows = []
    for part, of in zip(("train", "test"), known["motions"], strict=True):
        found = [clip for clip in known["clips"] if clip["part"] == part]
        if not found:
            continue
        frames, simulated = (sum(clip[key] for clip in found) for key in ("frames", "simulated"))
        weights = [clip["simulated"] for clip in found]
        means = [f"{np.average([clip[key] for clip in found], weights=weights):.0f}" for key in DISTANCES]
        seconds = sum(clip["seconds"] for clip in found)
        share = f"{100 * simulated / frames:.1f}"
        rows.append([part, f"{len(found)} of {of}", f"{seconds:.0f}", share, *means])
    head = ["part", "motions", "seconds", "frames simulated, %", *DISTANCES.values()]
    text = f"""Of the training part {known["windows"]} windows are used, and their mirror images: of frames
        that were simulated, within 20 cm of what the simulation followed."""
    return f"{table(head, rows)}\n{paragraph(text)}"


def scores(known: dict[str, Any]) -> str:
    """ADE, FDE and APD by sampling and training data, mean over seeds and their range."""
    rows = []
    for sampler, name in SAMPLERS.items():
        for kind, title in TITLES.items():
            cells = [_spread(values(known, kind, sampler, score).mean(axis=1)) for score in SCORES]
            rows.append([name, title, *cells])
    held = known["still"]
    rows.append(["–", "the last pose, held", *(f"{np.mean(held[score]):.3f}" for score in SCORES)])
    text = f"""Mean over {known["seeds"]} seeds, and their least and greatest. Ten samples; ADE and FDE are
        those of the best one, the mean over 14 root-aligned joints (and frames), as the paper says it;
        APD is the L2 distance of two futures as vectors of all 60 frames. At the paper's 50 frames a
        second APD would be √(100/60) = 1.29 times as large."""
    return f"{table(['model', 'trained on', *SCORES.values()], rows)}\n{paragraph(text)}"


def _spread(means: Array) -> str:
    return f"{means.mean():.3f} ({means.min():.3f}–{means.max():.3f})"


def against(known: dict[str, Any]) -> str:
    """Differences of training data, with intervals over motions."""
    rows = []
    for sampler, name in SAMPLERS.items():
        for other in ("fit", "truth"):
            for score, title in SCORES.items():
                both = pair(known, sampler, other, score)
                low, high = interval(known, *both)
                percent = 100 * (both[0].mean() / both[1].mean() - 1)
                cells = [f"{percent:+.1f}", f"{low:+.1f} to {high:+.1f}", apart(*both, score)]
                rows.append([name, f"(b) against {TITLES[other][:3]}", title, *cells])
    head = ["model", "", "score", "difference, %", "95 % interval over motions", "beyond the seeds' spread"]
    text = """The interval is of a bootstrap over the test motions. Beyond the seeds' spread: every seed of
        the one is on the same side of every seed of the other."""
    return f"{table(head, rows)}\n{paragraph(text)}"


def why(known: dict[str, Any]) -> str:
    """A test each of reconstruction, amount of data, and model."""
    found = [clip for clip in known["clips"] if clip["part"] == "train"]
    weights = [clip["simulated"] for clip in found]
    fit, simulation = (
        np.average([clip[f"{of}_mpjpe_mm"] for clip in found], weights=weights)
        for of in ("fit", "simulation")
    )
    ades = {kind: float(values(known, kind, "dlow", "ade").mean()) for kind in TITLES}
    seen = float(values(known, "truth", "seen", "ade").mean())
    rows = [
        ["reconstruction", "joints of the training motions from the recordings, fit and simulation",
         f"{fit:.0f} and {simulation:.0f} mm"],
        ["reconstruction", "ADE of (b) and (c) against (a), DLow",
         f"{_percent(ades['simulation'], ades['truth'])} and {_percent(ades['fit'], ades['truth'])}"],
        ["amount of data", "ADE with every second recording against all",
         _percent(ades["half"], ades["truth"])],
        ["model", "ADE of (a) on recordings that it has seen, and on others",
         f"{seen:.3f} and {ades['truth']:.3f} m"],
        ["model", "the same of the last pose, held",
         " and ".join(f"{np.mean(known[key]['ade']):.3f}" for key in ("still_seen", "still")) + " m"],
    ]  # fmt: skip
    return table(["what", "test", "measured"], rows)


def _percent(one: float, other: float) -> str:
    return f"{100 * (one / other - 1):+.1f} %"


def looks(known: dict[str, Any]) -> str:
    """Feet, nearness to training motions, simulation, speed."""
    rows = []
    for sampler, name in SAMPLERS.items():
        for kind in KINDS:
            cells = [f"{values(known, kind, sampler, look).mean():.1f}" for look in LOOKS]
            near = values(known, kind, sampler, "nearest_m").mean(), known["true_nearest"][kind]
            rows.append([name, TITLES[kind], *cells, *(f"{1e3 * value:.0f}" for value in near)])
    true = [f"{value:.1f}" for value in known["true_looks"]]
    rows.append(["–", "what happened", *true, "–", "–"])
    nearest = ["nearest training motion, mm", "that of what happened, mm"]
    (done, of), (good, stood) = (ended(known, balanced=balanced) for balanced in (False, True))
    feet = """Of the predicted joints, before they become poses. Skate: frames in which a heel or toe within 5
        cm of the floor is faster than 0.5 m/s; penetration: one is 3 cm under the floor; floating: all
        are over 5 cm for half a second around. The nearest training motion is the window of the
        training data with the least root mean square distance."""
    run = f"""Of the network that ships {done} of {of} futures are followed to the end by a simulation with
        the plan `quick`, and {good} of {stood} of those that start in balance: the extrapolated centre
        of mass is at most 10 cm outside the feet that touch the floor. Ten futures of two seconds take
        {1e3 * known["speed_s"]:.0f} ms of one core."""
    head = ["model", "trained on", *LOOKS.values(), *nearest]
    return f"{table(head, rows)}\n{paragraph(feet)}\n{paragraph(run)}"
