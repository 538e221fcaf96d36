"""What of a kinematic fit no body can do, and where a simulation may begin anew after a fall."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simrecon import scene as scenes
from simrecon.engines import momentum
from simrecon.engines.problem import Problem
from simrecon.metrics.dynamics import needed_load
from simrecon.scene import check
from simrecon.sim.state import initial_state
from simrecon.types import Array, Handover, IntArray, KinematicFit, Window

Mask = NDArray[np.bool_]

LOST_SHARE = 0.5
"""Of frames without the person: the fit invents the motion, and nobody can follow it."""
DEEP_M = 0.08
"""A reference that goes deeper into something than its rounded parts err (some 3 cm) can't be simulated."""
SMOOTH_S = 0.05
"""Of the centre of mass, before its acceleration is taken: noise of the fit is faster."""
LOAD_WEIGHTS = (-0.5, 6.0)
"""Upward force on the body, in body weights: landings from a metre come to 5, and nothing pulls down."""
HOVER_M, HOVER_S, HOVER_WEIGHTS = 0.25, 0.15, 0.5
"""A body whose every point is this far from any support, for so long, while something carries half of it."""


def begin(problem: Problem, fit: KinematicFit, window: Window) -> Handover | None:
    """The state at which a simulation may begin anew at a window, with no knots; None: not there.

    It begins at the pose of the reference and its velocity, where the person is in view, inside of nothing,
    and the window asks for no force that nothing can exert.

    Args:
        problem: of the clip.
        fit: that the reference was made of.
        window: with which the simulation would begin.
    """
    first, last = (step // problem.clock.stride for step in (window.start_step, window.end_step))
    rows = np.arange(first, last + 1)
    if fit.interpolated[first] or fit.interpolated[rows].mean() >= LOST_SHARE:
        return None
    depths = check.penetrations(problem.model, fit.scene, problem.qpos[first : first + 1])
    if any(entry.depth_m.max() > DEEP_M for entry in depths) or impossible(problem, fit, rows):
        return None
    velocity = momentum.first_velocity(problem.model, problem.qpos[first:], problem.clock.frame_s)
    state = initial_state(problem.model, problem.qpos[first], velocity)
    return Handover(state, np.zeros((0, problem.model.nu)))


def impossible(problem: Problem, fit: KinematicFit, rows: IntArray, load: Array | None = None) -> str:
    """What no body could do in some frames of the fit; empty if it is nothing of the kind.

    Args:
        problem: of the clip.
        fit: that the reference was made of.
        rows: (R,) the frames.
        load: (T,) as of `loads`, where many parts of one clip are asked for; None: it is worked out.
    """
    load, known = loads(problem, fit) if load is None else load, settled(problem, rows)
    if not known.any():
        return ""
    most, least = float(load[rows[known]].max()), float(load[rows[known]].min())
    low, high = LOAD_WEIGHTS
    if most > high:
        return f"the kinematic fit needs {most:.0f} times the person's weight from the floor"
    if least < low:
        return f"the kinematic fit is pulled down with {-least:.1f} times the person's weight"
    points = problem.points_m[rows]  # (R, M, 3)
    apart = (points[..., 2] - scenes.support_height(fit.scene, points[..., :2])).min(axis=1)
    up = apart > HOVER_M
    carried = load[rows[up & known]]
    if carried.size and carried.mean() > HOVER_WEIGHTS and longest_s(fit.times_s[rows], up) >= HOVER_S:
        return (
            f"the kinematic fit stands in the air, {100 * float(apart.max()):.0f} cm over anything, "
            f"where {carried.mean():.1f} times the person's weight would have to carry it"
        )
    return ""


def loads(problem: Problem, fit: KinematicFit) -> Array:
    """Upward force that the fit's centre of mass needs, body weights (T,)."""
    return needed_load(fit.com_m[:, 2], problem.clock.frame_s, SMOOTH_S)


def settled(problem: Problem, rows: IntArray) -> Mask:
    """Which frames are away from the ends of the clip, where smoothing stops whatever moves."""
    edge = int(np.ceil(2 * SMOOTH_S / problem.clock.frame_s))
    return np.asarray((rows >= edge) & (rows < problem.clock.frames - edge))


def longest_s(times_s: Array, flags: Mask) -> float:
    """Time from the first to the last frame of the longest run of flags (T,)."""
    longest, since = 0.0, None
    for time_s, flag in zip(times_s, flags, strict=True):
        since = (time_s if since is None else since) if flag else None
        longest = longest if since is None else max(longest, float(time_s - since))
    return longest
