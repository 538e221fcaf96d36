"""When points are in contact: by the labels of the fit, but for what cannot be."""

from __future__ import annotations

import numpy as np

from simrecon.io.messages import counted
from simrecon.metrics.dynamics import needed_load
from simrecon.planners.centroidal.points import Point, labelled
from simrecon.planners.centroidal.settings import PhaseRules
from simrecon.types import Array, Flags, KinematicFit

SMOOTH_S = 0.05
"""Of the centre of mass, before its acceleration is taken."""


def contacts(
    fit: KinematicFit, points: list[Point], apart_m: Array, com_m: Array, rules: PhaseRules
) -> tuple[Flags, list[str]]:
    """Flags (P, T), and in words what is not as labelled.

    Contact far from everything is dropped. Where nothing touches and yet something carries the person, what
    is lowest does.

    Args:
        fit: with labels.
        points: P.
        apart_m: (P, T) distance of each from what is nearest, negative inside.
        com_m: (T, 3).
        rules: thresholds.
    """
    flags = np.stack([labelled(fit, point.name, rules.contact) for point in points])
    far = flags & (np.abs(apart_m) > rules.contradiction_m)
    notes = [
        _said(point, own, away, fit.times_s)
        for point, own, away in zip(points, far, np.abs(apart_m), strict=True)
        if own.any()
    ]
    flags &= ~far
    hangs = ~flags.any(axis=0) & (load(com_m, float(fit.times_s[1] - fit.times_s[0])) > rules.carried)
    lowest = apart_m.min(axis=0)
    under = hangs & (apart_m < lowest + rules.level_m) & (lowest < rules.near_m)
    if under.any():
        first, last = fit.times_s[under.any(axis=0)][[0, -1]]
        names = " and ".join(
            point.name.replace("_", " ") for point, own in zip(points, under, strict=True) if own.any()
        )
        count = counted(int(under.any(axis=0).sum()), "frame")
        notes.append(
            f"nothing is labelled as in contact in {count} at {first:.2f} to {last:.2f} s, in which the "
            f"person does not fall; taken as in contact: {names}"
        )
    return flags | under, notes


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
