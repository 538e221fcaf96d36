"""90 % bands of pose and force, and how probable each contact is.

Pose: the spread of the kinematic fit (`kinematics.spread`), each of its two kinds times a factor, about the
simulated points.

Force: two estimates of it are there, what the simulation did, with the spread of the search's last
population, and what the plan asked for; and nobody knows to better than a frame when something touches. So
the population of a frame is that of the simulation and that of the plan, half each, of the frames within
`early_s` of it. Its mean is the middle of the band. Its variance, with a floor, and for the vertical force of
a foot with what the other one may bear in its stead, is that of the force:

    σ² = Var + (floor M g)² + (share p_left p_right F_z)²

and the band reaches as many σ to both sides as it takes for the truth to lie within in 90 % of the frames of
clips whose forces are known (`models/evidence/bands.toml`, docs/studies/bands.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.ndimage import uniform_filter1d

from simrecon import resources
from simrecon.contact import rules
from simrecon.engines.problem import FEET, Problem
from simrecon.io import tables
from simrecon.io.tables import number
from simrecon.replay.planned import loads
from simrecon.sim.address import locate
from simrecon.types import Array, Body, IntArray, KinematicFit, Motion, Reference, WindowResult

GRAVITY_MPS2 = 9.81


@dataclass(frozen=True)
class _Joints:
    across: float = number(0.0, 1e3)
    along: float = number(0.0, 1e3)


@dataclass(frozen=True)
class _Factors:
    all_horizontal: float = number(0.0, 1e3)
    all_vertical: float = number(0.0, 1e3)
    feet_horizontal: float = number(0.0, 1e3)
    feet_vertical: float = number(0.0, 1e3)


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """`models/evidence/bands.toml`."""

    floor: float = number(0.0, 10.0)
    share: float = number(0.0, 1.0)
    early_s: float = number(0.0, 1.0)
    joints: _Joints
    planned: _Factors
    alone: _Factors


@cache
def calibration() -> Calibration:
    """The one that ships."""
    where = "models/evidence/bands.toml"
    return tables.build(Calibration, resources.toml("models", "evidence", "bands.toml"), where)


@dataclass(frozen=True, eq=False)
class Forces:
    """Force on left foot, right foot and whole person at T frames, NaN where there is none of its own.

    Attributes:
        centre_N: (T, 3, 3); sigma_N: (T, 3, 3).
        touch: (T, C) probability that the scene pushes each part.
        planned: whether a plan's forces are part of it.
    """

    centre_N: Array
    sigma_N: Array
    touch: Array
    planned: bool

    def factors(self) -> Array:
        """From `sigma_N` to half the width of a band, (3, 3)."""
        known = calibration().planned if self.planned else calibration().alone
        foot = [known.feet_horizontal, known.feet_horizontal, known.feet_vertical]
        return np.array([foot, foot, [known.all_horizontal, known.all_horizontal, known.all_vertical]])


def banded(
    motion: Motion,
    problem: Problem,
    fit: KinematicFit,
    reference: Reference,
    windows: Sequence[WindowResult],
    grid: IntArray,
) -> Motion:
    """A motion with the bands that are known.

    Args:
        motion: simulated, or planned.
        problem: that the windows solve.
        fit: kinematic fit, on the problem's frames.
        reference: what the simulation was to follow, on the same frames.
        windows: solved; none of a plan.
        grid: (T,) the problem's frame that shows each of the motion's.
    """
    if fit.spread_m is not None:
        factors = calibration().joints
        across, along = fit.spread_m[:, grid]
        half = np.hypot(factors.across * across, factors.along * along)
        motion = replace(motion, band_joints_m=_band(motion.joints_m, half))
    known = forces(motion, problem, fit.body, reference, windows, grid)
    if known is None:
        return motion
    band = _band(known.centre_N, known.sigma_N * known.factors())  # (T, 3, 3, 2)
    band[..., 2, :] = np.maximum(band[..., 2, :], 0.0)  # nothing pulls
    return replace(motion, band_feet_N=band[:, :2], band_grf_N=band[:, 2], contact_probability=known.touch)


def forces(
    motion: Motion,
    problem: Problem,
    body: Body,
    reference: Reference,
    windows: Sequence[WindowResult],
    grid: IntArray,
) -> Forces | None:
    """The forces with their spread; None where no window has one. Arguments as of `banded`."""
    spread, touch = _of_windows(problem, body, windows)
    loaded = np.flatnonzero(motion.loaded & np.isfinite(spread[grid, 0, 0]))
    if not len(loaded):
        return None
    told = calibration()
    frame_s = float(np.median(np.diff(motion.times_s)))
    width = 1 + 2 * round(told.early_s / frame_s)
    near = loaded[
        np.abs(np.arange(len(grid))[:, None] - loaded).argmin(axis=1)
    ]  # (T,) where a frame has none
    force, sigma = shown(motion.contact_force_N, body)[near], spread[grid[near]]
    touching = touch[grid[near]]
    planned = reference.contact_force_N is not None
    asked, presses = force, touching
    if planned:
        parts = loads(reference, motion.contact_body)[0]
        parts = np.concatenate((parts[:1], (parts[1:] + parts[:-1]) / 2))[
            grid[near]
        ]  # since the frame before
        asked, presses = shown(parts, body), rules.loaded(np.linalg.norm(parts, axis=-1))
    square = force**2 + sigma**2
    if planned:
        square = (square + asked**2) / 2
    centre, square, probability = (
        uniform_filter1d(values, width, axis=0, mode="nearest")
        for values in ((force + asked) / 2, square, (touching + presses) / 2)
    )
    probability = np.clip(probability, 0.0, 1.0)  # a running mean rounds
    variance = np.maximum(square - centre**2, 0.0) + (told.floor * GRAVITY_MPS2 * body.mass_kg) ** 2
    both = _either(probability, body).prod(axis=-1)  # (T,)
    variance[:, :2, 2] += np.square(told.share * both * centre[:, 2, 2])[:, None]
    hidden = np.ones(len(grid), bool)
    hidden[loaded] = False
    for values in (centre, variance, probability):
        values[hidden] = np.nan
    return Forces(centre, np.sqrt(variance), probability, planned)


def _band(centre: Array, half: Array) -> Array:
    """Low and high end (..., 2)."""
    return np.stack((centre - half, centre + half), axis=-1)


def _of_windows(problem: Problem, body: Body, windows: Sequence[WindowResult]) -> tuple[Array, Array]:
    """Spread of force (T, 3, 3) and share that touches (T, C) at the problem's frames; NaN where unknown."""
    model, stride = problem.model, problem.clock.stride
    person = locate(model)
    own = np.flatnonzero(person.own_geoms(model))
    columns = np.searchsorted(own, person.geoms(model, [part.name for part in body.primitives]))
    force, touch = (
        np.full((len(problem.qpos), 3, 3), np.nan),
        np.full((len(problem.qpos), len(columns)), np.nan),
    )
    for result in windows:
        if result.spread is None:
            continue
        first = result.window.start_step // stride + 1
        rows = slice(first, first + len(result.spread.force_N))
        force[rows], touch[rows] = result.spread.force_N, result.spread.touch[:, columns]
    return force, touch


def feet_of(body: Body) -> Array:
    """Which primitives belong to each foot and what hangs on it, (2, C) bool."""
    found = np.zeros((2, len(body.primitives)), bool)
    for row, foot in enumerate(FEET):
        names = {foot}
        for name, parent in zip(body.skeleton.names, body.skeleton.parents, strict=True):
            if parent >= 0 and body.skeleton.names[parent] in names:
                names.add(name)
        found[row] = [part.segment in names for part in body.primitives]
    return found


def shown(parts: Array, body: Body) -> Array:
    """Force on left foot, right foot and all (T, 3, 3) of those on primitives (T, C, 3)."""
    left, right = (parts[:, own].sum(axis=1) for own in feet_of(body))
    return np.stack((left, right, parts.sum(axis=1)), axis=1)


def _either(probability: Array, body: Body) -> Array:
    """How probably each foot touches (T, 2), by its most probable part."""
    return np.stack([probability[:, own].max(axis=1) for own in feet_of(body)], axis=1)
