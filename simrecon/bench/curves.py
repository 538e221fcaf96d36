"""Forces of a result over time against those of its reference, drawn with matplotlib (extra `plot`)."""

from __future__ import annotations

import importlib.util
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simrecon.body.primitives import FEET
from simrecon.evaluation import simulated
from simrecon.evaluation.simulated import Simulated
from simrecon.io import atomic
from simrecon.metrics.dynamics import body_weight_pct, implied_grf
from simrecon.metrics.filters import low_pass, possible_hz
from simrecon.metrics.rates import at
from simrecon.metrics.truth import CUTOFF_HZ, SIDES, Truth, read_truth
from simrecon.system import extras
from simrecon.types import Array, Flags

NEEDS = "curves of forces"


@dataclass(frozen=True, eq=False)
class Curves:
    """Forces over time, per cent of body weight, through one filter.

    Attributes:
        times_s: (T,). cutoff_hz: of the filter.
        measured, simulated: (T, 2, 3) on the feet, left first.
        planned: (T, 3) that the centre of mass of plan or fit asks for, in all.
        known: (T,) frames in which the reference is to be trusted.
    """

    times_s: Array
    cutoff_hz: float
    measured: Array
    simulated: Array
    planned: Array
    known: Flags


def of(result: Simulated, truth: Truth) -> Curves | None:
    """The curves of a result; None where the reference has no forces, or none were simulated."""
    motion = result.motion
    if not motion.knows_forces or (truth.plates is None and truth.pushes is None):
        return None
    times = motion.times_s[1:] if motion.is_planned else 0.5 * (motion.times_s[1:] + motion.times_s[:-1])
    interval_s = float(np.median(np.diff(times)))
    mass_kg, known, cutoff_hz = result.mass_kg, np.ones(len(times), dtype=bool), CUTOFF_HZ
    if truth.plates is not None:
        force, cutoff_hz = truth.plates.force_N, truth.plates.cutoff_hz
        known = at(times, truth.times_s, truth.plates.known.astype(np.float64)) > 0.99
    else:
        force = truth.pushes.on(FEET) if truth.pushes is not None else np.zeros((0, 2, 3))
        times = motion.times_s[1:]
    cutoff_hz = possible_hz(cutoff_hz, max(interval_s, float(np.median(np.diff(truth.times_s)))))
    columns = [motion.contact_body.index(foot) for foot in FEET]
    asked = (result.planned or result.kinematic or result.body).com_m
    implied = implied_grf(asked, mass_kg, interval_s)  # of frames 1 to T - 2
    planned = at(times, motion.times_s[1:-1], implied)
    measured, own, planned = (
        low_pass(body_weight_pct(values, mass_kg), interval_s, cutoff_hz)
        for values in (at(times, truth.times_s, force), motion.contact_force_N[1:, columns], planned)
    )
    return Curves(times, cutoff_hz, measured, own, planned, known)


def drawable() -> bool:
    """Whether matplotlib is installed."""
    return importlib.util.find_spec("matplotlib") is not None


def write(folder: Path, truth: Path, target: Path) -> Path | None:
    """Draw the curves of a result to a PNG; its path, or None if there are none.

    Args:
        folder: of the result.
        truth: its reference.
        target: the PNG.

    Raises:
        InputError: matplotlib is not installed.
    """
    curves = of(simulated.read(folder), read_truth(truth))
    if curves is None:
        return None
    content = _drawn(curves)
    with atomic.reported(target):
        atomic.write_bytes(target, content)
    return target


def _drawn(curves: Curves) -> bytes:
    """Panels of both feet together, of each, and of what acts along: PNG."""
    figures = extras.load("matplotlib.figure", "plot", NEEDS)
    figure = figures.Figure(figsize=(8.0, 8.5))
    panels = figure.subplots(4, 1, sharex=True)
    times, own, measured = curves.times_s, curves.simulated, curves.measured
    along = int(np.ptp(measured.sum(axis=1)[:, :2], axis=0).argmax())
    shown: list[tuple[str, Array, Array, Array | None]] = [
        ("both feet, vertical", own.sum(1)[:, 2], measured.sum(1)[:, 2], curves.planned[:, 2])
    ]
    shown += [
        (f"{side} foot, vertical", own[:, k, 2], measured[:, k, 2], None) for k, side in enumerate(SIDES)
    ]
    name = f"both feet, along {'xy'[along]}"
    shown += [(name, own.sum(1)[:, along], measured.sum(1)[:, along], curves.planned[:, along])]
    for panel, (title, ours, reference, planned) in zip(panels, shown, strict=True):
        panel.plot(times, reference, "k", lw=1.6, label="reference")
        if planned is not None:
            panel.plot(times, planned, "tab:blue", lw=1.0, label="asked by the plan's centre of mass")
        panel.plot(times, ours, "tab:red", lw=1.2, label="simulation")
        panel.fill_between(
            times, 0, 1, where=~curves.known, transform=panel.get_xaxis_transform(), color="0.9", lw=0
        )
        panel.set_ylabel(f"{title}, %", fontsize=8)
        panel.grid(alpha=0.3)
    panels[0].set_title(f"per cent of body weight, low-passed at {curves.cutoff_hz:g} Hz", fontsize=9)
    panels[0].legend(fontsize=7)
    panels[-1].set_xlabel("s")
    figure.tight_layout()
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=80)
    return stream.getvalue()
