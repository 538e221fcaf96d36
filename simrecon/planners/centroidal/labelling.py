"""When points are in contact: by the labels of the fit, but for what cannot be."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from simrecon.io.messages import counted
from simrecon.metrics.dynamics import needed_load
from simrecon.planners.centroidal.points import Point, probability
from simrecon.planners.centroidal.resting import SURE, Costs, evidence, resting
from simrecon.planners.centroidal.settings import PhaseRules
from simrecon.types import Array, Flags, KinematicFit, runs

FRAME_S = 1 / 30
"""Of the evidence that a label is; of more frames a second each counts for less."""
CERTAIN = 1e6
"""Evidence of what must be, and against contact with what is far."""
SMOOTH_S = 0.05
"""Of the centre of mass, before its acceleration is taken."""


def contacts(
    fit: KinematicFit, points: list[Point], apart_m: Array, places_m: Array, com_m: Array, rules: PhaseRules
) -> tuple[Flags, list[str]]:
    """Flags (P, T), and in words what is not as labelled.

    Contact far from everything is dropped, and that of a point which moves is cut (`resting`). Where nothing
    touches and yet something carries the person, what is lowest does; where too few do, what is near. Where
    all of that moves too much to rest, the point rests that moves least: who lands while a foot of the fit
    still slides would else fall on, and be caught too late by forces as large as it takes.

    Args:
        fit: with labels.
        points: P.
        apart_m: (P, T) distance of each from what is nearest, negative inside.
        places_m: (P, T, 3) of each.
        com_m: (T, 3).
        rules: thresholds.
    """
    labels = [probability(fit, point.name) for point in points]
    far = np.stack(labels) >= rules.contact
    far &= np.abs(apart_m) > rules.contradiction_m
    notes = [
        _said(point, own, away, fit.times_s)
        for point, own, away in zip(points, far, np.abs(apart_m), strict=True)
        if own.any()
    ]
    known = np.stack([evidence(own, rules.contact) for own in labels]) - np.where(far, CERTAIN, 0.0)
    frame_s = float(fit.times_s[1] - fit.times_s[0])
    share = frame_s / FRAME_S  # of the evidence of a frame at 30 Hz
    costs = Costs(
        rules.spread_m / np.sqrt(share), rules.cut, max(1, int(np.ceil(rules.shortest_s / frame_s - 1e-6)))
    )

    def rested(row: int, evidence_: Array) -> tuple[Flags, float]:
        return resting(share * evidence_, places_m[row], costs)

    flags = np.stack([rested(row, own)[0] for row, own in enumerate(known)])
    needed = load(com_m, frame_s)
    under = _under(flags, apart_m, needed, rules)
    for row in np.flatnonzero(under.any(axis=1)).tolist():
        known[row, under[row]] = SURE
        flags[row] = rested(row, known[row])[0]
    # once each: where a point that rests here now moves instead, it flies
    for run in runs(_hangs(flags, apart_m, needed, rules)):
        rows = np.flatnonzero(_lowest(apart_m, rules)[:, run].any(axis=1)).tolist()
        row = min(rows, key=lambda row: _dearer(partial(rested, row), known[row], run))
        known[row, run], under[row, run] = CERTAIN, True
        flags[row] = rested(row, known[row])[0]
    if under.any():
        notes.append(_carried(points, under, fit.times_s))
    if not flags.any():
        notes.append("nothing is in contact in the whole clip; planned as one flight, a parabola")
    else:
        falls = ~flags.any(axis=0) & (needed > rules.carried)
        long = [run for run in runs(falls) if run.stop - run.start >= costs.fewest]
        notes += [_falls(run, rules, fit.times_s) for run in long]
    return flags, notes


def _dearer(rested: Callable[[Array], tuple[Flags, float]], known: Array, run: slice) -> float:
    """What it costs that a point with evidence (T,) rests in a run of frames, whatever the evidence there."""
    surely = known.copy()
    surely[run] = CERTAIN
    return rested(surely)[1] - rested(known)[1]


def _hangs(flags: Flags, apart_m: Array, load_: Array, rules: PhaseRules) -> Flags:
    """Frames (T,) in which nothing touches, and yet something near carries the person."""
    return np.asarray(~flags.any(axis=0) & (load_ > rules.carried) & (apart_m.min(axis=0) < rules.near_m))


def _lowest(apart_m: Array, rules: PhaseRules) -> Flags:
    """Points that are as low as the lowest, (P, T)."""
    return np.asarray(apart_m < apart_m.min(axis=0) + rules.level_m)


def _under(flags: Flags, apart_m: Array, load_: Array, rules: PhaseRules) -> Flags:
    """What carries the person beside what is labelled (P, T), under a load (T,) in body weights.

    What is lowest where nothing touches; where what touches cannot bear so much, as many as it takes of what
    is near, the lowest first.
    """
    hangs = _hangs(flags, apart_m, load_, rules) & _lowest(apart_m, rules)
    missing = np.where(flags.any(axis=0), np.ceil(load_ / rules.borne) - flags.sum(axis=0), 0.0)
    order = np.argsort(np.argsort(np.where(flags, np.inf, apart_m), axis=0), axis=0)
    heavy = ~flags & (order < missing) & (apart_m < rules.near_m)
    return np.asarray(hangs | heavy)


def _carried(points: list[Point], under: Flags, times_s: Array) -> str:
    first, last = times_s[under.any(axis=0)][[0, -1]]
    names = " and ".join(
        point.name.replace("_", " ") for point, own in zip(points, under, strict=True) if own.any()
    )
    count = counted(int(under.any(axis=0).sum()), "frame")
    return (
        f"too little is labelled as in contact to carry the person in {count} at {first:.2f} to "
        f"{last:.2f} s; taken as in contact: {names}"
    )


def _falls(run: slice, rules: PhaseRules, times_s: Array) -> str:
    first, last = times_s[run][[0, -1]]
    return (
        f"the person does not fall at {first:.2f} to {last:.2f} s, but nothing rests within "
        f"{100 * rules.near_m:.0f} cm to carry it; planned as flight there"
    )


def load(com_m: Array, frame_s: float) -> Array:
    """Upward force that a centre of mass (T, 3) needs, body weights (T,)."""
    edge = int(np.ceil(2 * SMOOTH_S / frame_s))
    needed = needed_load(com_m[:, 2], frame_s, SMOOTH_S)
    rows = np.arange(len(needed))
    if len(rows) <= 2 * edge:
        return np.ones(len(rows))
    return np.asarray(needed[np.clip(rows, edge, len(rows) - 1 - edge)])


def _said(point: Point, far: Flags, apart_m: Array, times_s: Array) -> str:
    first, last = times_s[far][[0, -1]]
    name = point.name.replace("_", " ")
    return (
        f"{name}: labelled as in contact at {first:.2f} to {last:.2f} s, but up to "
        f"{100 * apart_m[far].max():.0f} cm from what is nearest; taken as in flight there"
    )
