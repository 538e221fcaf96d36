"""What a planner could not explain of its reference, for the report."""

from __future__ import annotations

import numpy as np

from simrecon.metrics.dynamics import GRAVITY_MPS2, grf_norm_pct
from simrecon.pipeline import Reconstruction
from simrecon.types import Reference

PERCENTILE = 95.0
DISTANT_M = 0.02
"""From the scene: nothing that is farther can push; a foot in a shoe may be so much off."""


def make(run: Reconstruction) -> dict[str, float | None] | None:
    """The section `planned` of a report (docs/formats.md); None if the planner knows no dynamics.

    Wrenches are norms, each frame's, of force and of moment; weight is m g, and the moment's unit m g h.
    Distant forces are the sum of the sizes of those that act where nothing is within `DISTANT_M`; None where
    planned contacts touch by definition.
    """
    wrench = run.reference.root_wrench  # (T, 6)
    if wrench is None:
        return None
    weight_N = run.fit.body.mass_kg * GRAVITY_MPS2
    force = np.linalg.norm(wrench[:, :3], axis=1) / weight_N
    moment = np.linalg.norm(wrench[:, 3:], axis=1) / (weight_N * run.fit.body.height_m)
    return {
        "wrench_force_pct": 100.0 * float(np.percentile(force, PERCENTILE)),
        "wrench_moment_pct": 100.0 * float(np.percentile(moment, PERCENTILE)),
        "distant_force_pct": _distant(run.reference, weight_N),
        **_pushed(run.reference, run.fit.body.mass_kg),
    }


def _pushed(reference: Reference, mass_kg: float) -> dict[str, float]:
    """Mean and most of the norm of the planned ground reaction force (Rempe 2020, table 2)."""
    if reference.contact_force_N is None:
        return {}
    norm = grf_norm_pct(reference.contact_force_N.sum(axis=1), mass_kg)  # (T,)
    return {"grf_mean_pct": float(norm.mean()), "grf_max_pct": float(norm.max())}


def _distant(reference: Reference, weight_N: float) -> float | None:
    """Force from a distance, per cent of body weight."""
    if reference.contact_force_N is None or reference.contact_apart_m is None:
        return None
    size = np.linalg.norm(reference.contact_force_N, axis=-1)  # (T, C)
    distant = np.where(reference.contact_apart_m > DISTANT_M, size, 0.0).sum(axis=1) / weight_N
    return 100.0 * float(np.percentile(distant, PERCENTILE))
