"""Scores of what the items of a scene do to the person: loads, depths, sink.

Axes: T frames.
"""

from __future__ import annotations

import numpy as np

from simrecon import scene as scenes
from simrecon.evaluation.comparison import Comparison
from simrecon.evaluation.loads import loads
from simrecon.evaluation.rises import SITS_LEAST_M, releases, rests, rises
from simrecon.evaluation.simulated import Simulated
from simrecon.metrics.dynamics import body_weight_pct
from simrecon.metrics.rates import at
from simrecon.metrics.statistics import Scores
from simrecon.scene import check, sheets
from simrecon.types import Array, Flags


def scores(result: Simulated, on: Comparison) -> Scores:
    """Loads and depths of the items, and the sink of those that are sprung; none without items.

    Of a plan, which says of no force which item it is from, only depths.

    Args:
        result: of which.
        on: what the motions are compared on; its reference says when the person sits and stands.
    """
    if not result.scene.items:
        return Scores()
    motion = result.motion
    numbers = {} if motion.is_planned else _borne(result, on) | _sheets(result)
    depths = [
        entry.depth_m.max()
        for entry in check.penetrations(result.model, result.scene, motion.qpos[motion.loaded])
        if entry.name != scenes.GROUND_GEOM
    ]
    return Scores({}, numbers | {"item_penetration_max_mm": 1e3 * float(max(depths, default=0.0))})


def _borne(result: Simulated, on: Comparison) -> dict[str, float]:
    """What bears the person: the items' share, on average, and while the reference sits and stands."""
    motion, mass = result.motion, result.mass_kg
    vertical = body_weight_pct(loads(result.model, result.scene, motion), mass)[..., 2].sum(-1)  # (T,)
    kept = motion.loaded
    total = float(body_weight_pct(motion.grf_N, mass)[kept, 2].mean())
    numbers = {"item_load_pct": 100.0 * float(vertical[kept].mean()) / total if total > 0 else np.nan}
    known = at(on.times_s, motion.times_s, kept.astype(np.float64)) > 0.99  # not the first frame, no fallback
    return numbers | _sitting(at(on.times_s, motion.times_s, vertical), known, on)


def _sitting(borne_pct: Array, known: Flags, on: Comparison) -> dict[str, float]:
    """What bears the person (T,) while the reference sits and stands; nothing if its hips stay level."""
    hips = on.truth.at(on.times_s, ("left_hip", "right_hip")).mean(axis=1)  # (T, 3)
    if np.ptp(hips[:, 2]) <= SITS_LEAST_M:
        return {}
    sitting, standing = (still & known for still in rests(hips, on.interval_s))
    return {
        "item_sitting_pct": float(borne_pct[sitting].mean()) if sitting.any() else np.nan,
        "item_standing_pct": float(borne_pct[standing].max()) if standing.any() else np.nan,
        "rises": float(releases(borne_pct[known], on.interval_s)),
        "reference_rises": float(rises(hips[:, 2])),
    }


def _sheets(result: Simulated) -> dict[str, float]:
    """Sink of mats and trampolines, and how high the centre of mass comes over where it began."""
    if not any(sheets.sheet_of(item) for item in result.scene.items):
        return {}
    model, motion = result.model, result.motion
    tiles = [i for i in range(model.njnt) if "/tile_" in model.joint(i).name]
    kept = motion.kept
    sink = -motion.qpos[kept][:, model.jnt_qposadr[tiles]].min(axis=1)  # (T,)
    rise = motion.com_m[kept, 2] - motion.com_m[0, 2]
    return {
        "sheet_sink_mm": 1e3 * float(sink.max()),
        "apex_mm": 1e3 * float(rise.max()),
        "apex_s": float(motion.times_s[kept][rise.argmax()]),
    }
