"""Where and why a clip is not simulated, and whether the person fell."""

from __future__ import annotations

from typing import Any

import numpy as np

from simrecon.engines import restarts
from simrecon.pipeline import Reconstruction
from simrecon.replay import FALLBACK
from simrecon.scene import check
from simrecon.scene.mjcf import GROUND_GEOM
from simrecon.types import IntArray, Motion, runs

FELL, LOST, PENETRATION, IMPOSSIBLE = "fell", "lost", "penetration", "impossible reference"
BEFORE_S = 0.25
"""How long before the last simulated frame the reason may lie: the look-ahead of a window."""
FALL_M, FALL_S = 0.3, 0.2
"""A person fell whose pelvis is so far below the kinematic fit's for so long."""
FAST_RADPS = 8.0
"""A pelvis that turns faster is in a somersault, a roll or a kick."""


def make(run: Reconstruction) -> list[dict[str, Any]]:
    """The section `gaps` of a report (docs/formats.md): runs of frames that are not simulated, and why."""
    return [_gap(run, rows.start, rows.stop - 1) for rows in runs(run.motion.status == FALLBACK)]


def _gap(run: Reconstruction, first: int, last: int) -> dict[str, Any]:
    motion = run.motion
    rows = _rows(run, float(motion.times_s[max(first - 1, 0)]))
    reason, detail = _reason(run, rows)
    known = rows[restarts.settled(run.problem, rows)]
    load = restarts.loads(run.problem, run.fit)[known if known.size else rows]
    return {
        "from_s": float(motion.times_s[first]),
        "to_s": float(motion.times_s[last]),
        "frames": last - first + 1,
        "reason": reason,
        "detail": detail,
        "load_weights": [float(load.min()), float(load.max())],
        "plan": _plan(run, rows) if reason == FELL else None,
    }


def fell(motion: Motion) -> bool:
    """Whether a simulated pelvis was `FALL_M` or more below the kinematic fit's for `FALL_S` on end."""
    if motion.kinematic_qpos is None or motion.is_planned:
        return False
    low = motion.kinematic_qpos[:, 2] - motion.qpos[:, 2] >= FALL_M  # (T,)
    return restarts.longest_s(motion.times_s, low) >= FALL_S


def _rows(run: Reconstruction, last_s: float) -> IntArray:
    """Frames of the uniform clock around a fall: a little before it, and the window that failed."""
    since = run.fit.times_s - run.motion.times_s[0]
    at = last_s - run.motion.times_s[0]
    inside = (since >= at - BEFORE_S) & (since <= at + run.problem.plan.window.length_s)
    return np.flatnonzero(inside).astype(np.int64)


def _reason(run: Reconstruction, rows: IntArray) -> tuple[str, str]:
    """Why the simulation ended around these frames, and what was seen there."""
    unseen = float(run.fit.interpolated[rows].mean())
    if unseen >= restarts.LOST_SHARE:
        return LOST, f"the person is out of view in {100 * unseen:.0f} % of the frames there"
    for entry in check.penetrations(run.problem.model, run.fit.scene, run.problem.qpos[rows]):
        if entry.depth_m.max() > restarts.DEEP_M:
            name = "the floor" if entry.name == GROUND_GEOM else f"item {entry.name!r}"
            depth = 100 * float(entry.depth_m.max())
            return (
                PENETRATION,
                f"the kinematic fit has {entry.parts[entry.deepest]} {depth:.0f} cm inside {name}",
            )
    if impossible := restarts.impossible(run.problem, run.fit, rows):
        return IMPOSSIBLE, impossible
    return FELL, "the simulated body could not follow the kinematic fit there"


def _plan(run: Reconstruction, rows: IntArray) -> str | None:
    """A plan that may hold where this one did not; None after the strongest."""
    name = run.problem.plan.name
    order = {"quick": "default", "default": "overnight", "flips": "overnight"}
    if name in ("quick", "default") and _turns_fast(run, rows):
        return "flips"
    return order.get(name)


def _turns_fast(run: Reconstruction, rows: IntArray) -> bool:
    root = run.problem.orientations[rows][:, 0]  # (R, 4)
    if len(root) < 2:
        return False
    cosine = np.abs((root[1:] * root[:-1]).sum(axis=-1)).clip(0.0, 1.0)
    return bool((2 * np.arccos(cosine) / run.problem.clock.frame_s).max() > FAST_RADPS)
