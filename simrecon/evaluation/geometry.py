"""Footskate, float and penetration of a body's own primitives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simrecon.body.primitives import FEET
from simrecon.evaluation.configurations import Configurations
from simrecon.metrics import clearance, feet
from simrecon.metrics.rates import H36M_HZ, resampled
from simrecon.metrics.statistics import Scores, Series, of_frames
from simrecon.types import Array, Flags


def geometry(
    shape: Configurations, names: Sequence[str], times_s: Array, kept: Flags | None = None
) -> Scores:
    """Footskate, float and penetration of the primitives.

    Args:
        shape: of the configurations of a body.
        names: of its points.
        times_s: (T,) of the frames.
        kept: (T,) frames that count, or None for all.
    """
    rows = np.ones(len(shape.feet_m), bool) if kept is None else np.asarray(kept)  # (T,)
    if rows.sum() < 2:
        return Scores()
    depth = clearance.penetration_depths(shape.floor_m[rows])
    series = {
        "penetration_mean_mm": of_frames(depth, scale=1e3),
        "penetration_pct": of_frames(clearance.penetrating_frames(shape.scene_m[rows]), scale=100.0),
    }
    numbers = {"penetration_max_mm": 1e3 * float(depth.max())}
    return Scores(series | _feet(shape, names, times_s, rows), numbers)


def _feet(shape: Configurations, names: Sequence[str], times_s: Array, kept: Flags) -> dict[str, Series]:
    """Footskate and float (Gärtner 2022) at 25 frames a second."""
    columns = [list(names).index(f"{foot.split('_')[0]}_ankle") for foot in FEET]
    own = (shape.points_m[:, columns], shape.corners_m, shape.feet_m, shape.soles_m, shape.scene_m)
    ankles, corners, low, soles, parts = (resampled(times_s[kept], values[kept], H36M_HZ) for values in own)
    flags = {
        "footskate_gartner_pct": feet.footskate_steps(ankles, low),
        "footskate_sole_pct": feet.footskate_steps(corners, soles),
        "float_gartner_pct": feet.float_frames(low),
        "float_body_pct": feet.float_body_frames(low, parts),
    }
    return {name: of_frames(flag, scale=100.0) for name, flag in flags.items()}
