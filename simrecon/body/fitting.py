"""Primitives fitted to a skin, Gärtner 2022, eq. 9, by nlopt in seconds; `sizes.regress` is the fast way.

For every segment b the mean distance of the skin's vertices v_g ∈ M_b to the surface M̂_b of its primitives
plus the mean distance of points v_p on M̂_b to M_b is minimised over ψ:

    L(ψ) = Σ_b [ mean_g min_p ‖v_g - v_p‖ + mean_p min_g ‖v_p - v_g‖ ]

Vertices and points weigh by the area that they stand for. M̂_b is the surface of the union: what lies within
another primitive of the segment is no part of it. M_b is closed where it meets other segments
(`pieces.Piece`).
"""

from __future__ import annotations

import numpy as np

from simrecon.body import pieces, sizes, surface
from simrecon.body.primitives import entries
from simrecon.body.skeleton import template
from simrecon.body.targets import Target
from simrecon.optim import lbfgs
from simrecon.types import Array, IntArray

ROUNDS, EVALUATIONS = 4, 60


def fit(goals: dict[str, Target], start: Array) -> Array:
    """Sizes ψ (S,) of the primitives that minimise eq. 9, segment by segment.

    Args:
        goals: the segments, from `targets`.
        start: (S,) where to begin.
    """
    layout = sizes.layout()
    psi = np.maximum(start, layout.lower)
    for name, goal in goals.items():
        rows = [i for i, segment in enumerate(layout.segments) if segment == name]
        columns = np.flatnonzero(np.abs(layout.matrix[rows]).sum(axis=(0, 1)))
        for _ in range(ROUNDS):
            problem = _Segment(goal, rows, columns, psi)
            solved = lbfgs.minimize(
                problem,
                psi[columns],
                max_evaluations=EVALUATIONS,
                ftol_rel=1e-5,
                lower=layout.lower[columns],
            )
            better = psi.copy()
            better[columns] = solved.x
            if loss(goal, rows, better) >= loss(goal, rows, psi) - 1e-6:
                break
            psi = better
    return psi


def loss(goal: Target, rows: list[int], psi: Array) -> float:
    """Eq. 9 of one segment, m: the sum of both directions' means.

    Args:
        goal: the segment.
        rows: its primitives in the layout.
        psi: (S,) sizes.
    """
    areas = _areas(goal, rows, psi)
    if not any(area.any() for area in areas):  # each lies within another one
        return float("inf")
    return _loss(goal, rows, sizes.values(psi)[rows], areas)[0]


class _Segment:
    """Eq. 9 of one segment as a function of its sizes.

    Which points lie within another primitive, and the areas that points stand for, are those at `now`:
    between rounds they change, within one the function is smooth enough for L-BFGS.
    """

    def __init__(self, goal: Target, rows: list[int], columns: IntArray, now: Array) -> None:
        self.goal, self.rows, self.columns, self.now = goal, rows, columns, now
        self.matrix = sizes.layout().matrix[rows][:, :, columns]  # (e, 9, s)
        self.rest = sizes.values(now)[rows] - self.matrix @ now[columns]  # (e, 9) zero by the layout
        self.areas = _areas(goal, rows, now)

    def __call__(self, x: Array) -> tuple[float, Array]:
        values = self.matrix @ x + self.rest
        loss, slope = _loss(self.goal, self.rows, values, self.areas)
        return loss, np.einsum("ev,evs->s", slope, self.matrix)


def _areas(goal: Target, rows: list[int], full: Array) -> list[Array]:
    """Area of each sample of each primitive, zero within another one of the segment; sum 1 over all."""
    layout, values = sizes.layout(), sizes.values(full)
    areas = []
    for row in rows:
        points, area, _ = surface.samples(layout.kinds[row], values[row])
        points = _fold(goal, points)[0]
        for other in rows:
            if other != row:
                area = area * (surface.distance(layout.kinds[other], values[other], points)[0] > 0)
        areas.append(area * (0.5 if goal.folded and layout.central[row] else 1.0))
    total = max(sum(float(area.sum()) for area in areas), 1e-12)
    return [area / total for area in areas]


def _fold(goal: Target, points_m: Array) -> tuple[Array, Array]:
    """Points mirrored to the left half where the segment is in the middle, and the signs (P, 3)."""
    sign = np.ones_like(points_m)
    if goal.folded:
        sign[:, 1] = np.where(points_m[:, 1] < 0, -1.0, 1.0)
    return points_m * sign, sign


def _loss(goal: Target, rows: list[int], values: Array, areas: list[Array]) -> tuple[float, Array]:
    """Eq. 9 of one segment and its derivative by the values (e, 9) of its primitives."""
    kinds = sizes.layout().kinds
    slope = np.zeros_like(values)
    both = [surface.distance(kinds[row], values[e], goal.own_m) for e, row in enumerate(rows)]
    signed = np.stack([distance for distance, _ in both])  # (e, n)
    nearest = np.argmin(signed, axis=0)
    least = signed.min(axis=0)
    loss = float(goal.weights @ np.abs(least))
    for e, (_, derivative) in enumerate(both):
        slope[e] += (goal.weights * np.sign(least) * (nearest == e)) @ derivative
    for e, row in enumerate(rows):
        points, _, moved = surface.samples(kinds[row], values[e])
        used = areas[e] > 0
        if not used.any():
            continue
        points, sign = _fold(goal, points[used])
        away = points - pieces.closest(goal.piece, goal.vertices_m, points)
        far = np.linalg.norm(away, axis=1)
        loss += float(areas[e][used] @ far)
        pull = (areas[e][used] / np.maximum(far, 1e-6))[:, None] * away * sign  # (P, 3)
        slope[e] += np.einsum("pi,piv->v", pull, moved[used])
    return loss, slope


def start(scale_m: float) -> Array:
    """Sizes ψ (S,), m, by the proportions of `models/body/primitives.toml`, at a stature in m."""
    values = np.zeros((len(sizes.layout().names), sizes.VALUES))
    unit = template()
    by_name = {entry["name"]: entry for entry in entries()}
    for i, name in enumerate(sizes.layout().names):
        entry = by_name[name]
        if entry["kind"] == "box":
            centre, half = entry.get("centre", [0.035, 0.0, -0.024]), entry.get("half", [0.07, 0.026, 0.015])
            values[i, :3], values[i, 6:] = centre, half
        elif "along" in entry:
            values[i, :6] = np.outer(
                entry["along"], unit.offsets_m[unit.names.index(entry["to_joint"])]
            ).ravel()
            values[i, 6] = entry["radius"]
        else:
            values[i, :6], values[i, 6] = [*entry["from"], *entry["to"]], entry["radius"]
    return sizes.pack(values * scale_m)
