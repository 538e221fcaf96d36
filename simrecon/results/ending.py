"""Where and why a simulation ended before its clip, and whether the person fell."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from simrecon import scene as scenes
from simrecon.metrics.dynamics import GRAVITY_MPS2
from simrecon.pipeline import Reconstruction
from simrecon.replay import FALLBACK
from simrecon.scene import check
from simrecon.scene.mjcf import GROUND_GEOM
from simrecon.types import Array, IntArray, Motion

Mask = NDArray[np.bool_]

FELL, LOST, PENETRATION, IMPOSSIBLE = "fell", "lost", "penetration", "impossible reference"
BEFORE_S = 0.25
"""How long before the last simulated frame the reason may lie: the look-ahead of a window."""
LOST_SHARE = 0.5
"""Of those frames without the person: the fit invents the motion, and nobody can follow it."""
DEEP_M = 0.08
"""A reference that goes deeper into something than its rounded parts err (some 3 cm) can't be simulated."""
SMOOTH_S = 0.05
"""Of the centre of mass, before its acceleration is taken: noise of the fit is faster."""
LOAD_WEIGHTS = (-0.5, 6.0)
"""Upward force on the body, in body weights: landings from a metre come to 5, and nothing pulls down."""
HOVER_M, HOVER_S, HOVER_WEIGHTS = 0.25, 0.15, 0.5
"""A body whose every point is this far from any support, for so long, while something carries half of it."""
FALL_M, FALL_S = 0.3, 0.2
"""A person fell whose pelvis is so far below the kinematic fit's for so long."""
FAST_RADPS = 8.0
"""A pelvis that turns faster is in a somersault, a roll or a kick."""


def make(run: Reconstruction) -> dict[str, Any] | None:
    """The section `ending` of a report (docs/formats.md); None if all frames are simulated."""
    motion = run.motion
    fallback = np.flatnonzero(motion.status == FALLBACK)
    if not fallback.size:
        return None
    first = int(fallback[0])
    last_s = float(motion.times_s[max(first - 1, 0)])
    rows = _rows(run, last_s)
    reason, detail = _reason(run, rows)
    return {
        "from_s": float(motion.times_s[first]),
        "to_s": float(motion.times_s[fallback[-1]]),
        "reason": reason,
        "detail": detail,
        "plan": _plan(run, rows) if reason == FELL else None,
    }


def fell(motion: Motion) -> bool:
    """Whether the pelvis was `FALL_M` or more below that of the kinematic fit for `FALL_S` on end."""
    if motion.kinematic_qpos is None:
        return False
    low = motion.kinematic_qpos[:, 2] - motion.qpos[:, 2] >= FALL_M  # (T,)
    return _longest_s(motion.times_s, low) >= FALL_S


def _longest_s(times_s: Array, flags: Mask) -> float:
    """Time from the first to the last frame of the longest run of flags (T,)."""
    longest, since = 0.0, None
    for time_s, flag in zip(times_s, flags, strict=True):
        since = (time_s if since is None else since) if flag else None
        longest = longest if since is None else max(longest, float(time_s - since))
    return longest


def _rows(run: Reconstruction, last_s: float) -> IntArray:
    """Frames of the uniform clock around the end: a little before it, and the window that failed."""
    since = run.fit.times_s - run.motion.times_s[0]
    at = last_s - run.motion.times_s[0]
    inside = (since >= at - BEFORE_S) & (since <= at + run.problem.plan.window.length_s)
    return np.flatnonzero(inside).astype(np.int64)


def _reason(run: Reconstruction, rows: IntArray) -> tuple[str, str]:
    """Why the simulation ended around these frames, and what was seen there."""
    unseen = float(run.fit.interpolated[rows].mean())
    if unseen >= LOST_SHARE:
        return LOST, f"the person is out of view in {100 * unseen:.0f} % of the frames there"
    for entry in check.penetrations(run.problem.model, run.fit.scene, run.problem.qpos[rows]):
        if entry.depth_m.max() > DEEP_M:
            name = "the floor" if entry.name == GROUND_GEOM else f"item {entry.name!r}"
            depth = 100 * float(entry.depth_m.max())
            return (
                PENETRATION,
                f"the kinematic fit has {entry.parts[entry.deepest]} {depth:.0f} cm inside {name}",
            )
    if impossible := _impossible(run, rows):
        return IMPOSSIBLE, impossible
    return FELL, "the simulated body could not follow the kinematic fit there"


def _impossible(run: Reconstruction, rows: IntArray) -> str:
    """What no body could do in these frames of the fit; empty if it is nothing of the kind."""
    load, known = _load(run), _settled(run, rows)
    if not known.any():
        return ""
    most, least = float(load[rows[known]].max()), float(load[rows[known]].min())
    low, high = LOAD_WEIGHTS
    if most > high:
        return f"the kinematic fit needs {most:.0f} times the person's weight from the floor"
    if least < low:
        return f"the kinematic fit is pulled down with {-least:.1f} times the person's weight"
    points = run.problem.points_m[rows]  # (R, M, 3)
    apart = (points[..., 2] - scenes.support_height(run.fit.scene, points[..., :2])).min(axis=1)
    up = apart > HOVER_M
    carried = load[rows[up & known]]
    if carried.size and carried.mean() > HOVER_WEIGHTS and _longest_s(run.fit.times_s[rows], up) >= HOVER_S:
        return f"the kinematic fit stands in the air, {100 * float(apart.max()):.0f} cm over anything"
    return ""


def _load(run: Reconstruction) -> Array:
    """Upward force that the fit's centre of mass needs, body weights (T,)."""
    interval = run.problem.clock.frame_s
    com = gaussian_filter1d(run.fit.com_m[:, 2], SMOOTH_S / interval, mode="nearest")
    acceleration = np.gradient(np.gradient(com, interval), interval)
    return np.asarray(1 + acceleration / GRAVITY_MPS2)


def _settled(run: Reconstruction, rows: IntArray) -> Mask:
    """Which frames are away from the ends of the clip, where smoothing stops whatever moves."""
    edge = int(np.ceil(2 * SMOOTH_S / run.problem.clock.frame_s))
    return np.asarray((rows >= edge) & (rows < len(run.fit.com_m) - edge))


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
