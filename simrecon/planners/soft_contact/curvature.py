"""The Hessian of the laws of motion in the approximation of Gauss and Newton, for `conditioning`.

Where forces can change freely, a wrench costs nothing: the curvature of the least loss by the wrench is the
inverse of that of the dual (`forces.Explained.stiffness`). Prices of forces curve by distance and slip.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from simrecon.geometry import rotations
from simrecon.kinematics import curvature as kinematic
from simrecon.kinematics.bands import REACH
from simrecon.kinematics.hessian import Curvature
from simrecon.kinematics.jacobian import of_points, of_shared
from simrecon.kinematics.layout import FREE, Variables
from simrecon.kinematics.state import State
from simrecon.planners.soft_contact import steady
from simrecon.planners.soft_contact.forces import Explained
from simrecon.planners.soft_contact.objective import Planned
from simrecon.planners.soft_contact.physics import Motion
from simrecon.types import Array


def curvature(planned: Planned, variables: Variables) -> Iterator[Curvature]:
    """Curvature of an objective at the variables, one block of frames after the other."""
    problem = planned.problem
    _, found = planned.explained(variables.pack())
    start = 0
    for part in kinematic.curvature(problem, variables):
        stop = start + len(part.border)
        near = slice(max(start - REACH, 0), min(stop + REACH, problem.frames))
        if near.stop - near.start > REACH:
            motion = Motion(State(problem.part(near), variables.part(near)), planned.world)
            own = slice(start - near.start, stop - near.start)
            whole = _Whole(motion, _part(found, near), planned.weight * problem.dt)
            blocks = whole.blocks()
            added = [block + more[own][: len(block)] for block, more in zip(part.blocks, blocks, strict=True)]
            part = replace(part, blocks=(added[0], added[1], added[2]))
            if planned.lengths:
                part = _with_shared(part, *whole.shared(), own)
        yield part
        start = stop


def _part(found: Explained, near: slice) -> Explained:
    """Of the frames that have an acceleration among those near."""
    rows = slice(near.start, near.stop - REACH)
    return Explained(found.forces[rows], found.residual[rows], found.stiffness[rows])


def _with_shared(part: Curvature, border: Array, corner: Array, own: slice) -> Curvature:
    """A block with the curvature by scale, sole and lengths, (T, FREE, 2 + L) and (T, 2 + L, 2 + L)."""
    count = border.shape[-1]
    wide, square = part.border.copy(), part.corner.copy()
    wide[..., :count] += border[own]
    square[:count, :count] += corner[own].sum(axis=0)
    return replace(part, border=wide, corner=square)


class _Whole:
    """The curvature of some frames, all at once."""

    def __init__(self, motion: Motion, found: Explained, unit: float) -> None:
        self.motion, self.found, self.unit = motion, found, unit
        masses, state = motion.world.masses, motion.state
        moved = of_points(state.problem.skeleton, state.pose, masses.segments, motion.masses_m)
        self.rows = _by_unknowns(motion, moved)  # of frame t - 1, t and t + 1, (n, 6, FREE) each
        self.centre = _centre(motion, moved)

    def blocks(self) -> list[Array]:
        """Blocks of frame t + k with frame t, (T, FREE, FREE) each, zero where the clip ends."""
        frames = len(self.centre)
        blocks = [np.zeros((frames, FREE, FREE)) for _ in range(REACH + 1)]
        weighted = [self._weighted(row) for row in self.rows]
        for i in range(REACH + 1):
            for j in range(i + 1):
                blocks[i - j][j : j + frames - 2] += np.swapaxes(self.rows[i], 1, 2) @ weighted[j]
        _priced(self.motion, self.found, self.unit, blocks)
        blocks[0] += self._place * (np.swapaxes(self.centre, 1, 2) @ self.centre)
        return blocks

    def shared(self) -> tuple[Array, Array]:
        """By scale, sole and lengths: with the unknowns of a frame (T, FREE, 2 + L), and with each other.

        What prices of forces curve is left out, which the search can do without.
        """
        motion, masses = self.motion, self.motion.world.masses
        moved = of_shared(motion.state, masses.segments, motion.masses_m, np.zeros_like(masses.offsets_m))
        centre, row = _centre(motion, moved), np.sum(_by_unknowns(motion, moved), axis=0)
        weighted = self._weighted(row)
        border = self._place * (np.swapaxes(self.centre, 1, 2) @ centre)
        corner = self._place * (np.swapaxes(centre, 1, 2) @ centre)
        for i, own in enumerate(self.rows):
            border[i : i + len(own)] += np.swapaxes(own, 1, 2) @ weighted
        corner[1:-1] += np.swapaxes(row, 1, 2) @ weighted
        return border, corner

    @property
    def _place(self) -> float:
        return self.unit / self.motion.world.scales.place_m**2

    def _weighted(self, row: Array) -> Array:
        """Curvature by the wrench, times a derivative of it (n, 6, …)."""
        rough = steady.rate_curvature(self.motion.world.change(self.motion.state.dt))
        return np.asarray(self.unit * (np.linalg.solve(self.found.stiffness, row) + rough * row))


def _centre(motion: Motion, moved: Array) -> Array:
    """Derivative (T, 3, …) of the centre of mass, by that of the point masses (T, N, 3, …)."""
    masses = motion.world.masses
    return np.asarray(np.einsum("p,tpif->tif", masses.mass_kg / masses.total_kg, moved))


def _by_unknowns(motion: Motion, moved: Array) -> list[Array]:
    """Derivative of the wrench (n, 6) by F unknowns of the frame before, its own and the one after.

    Args:
        motion: of T frames.
        moved: (T, N, 3, F) derivative of the point masses.
    """
    state, world = motion.state, motion.world
    masses = world.masses
    mass = masses.mass_kg / state.dt**2
    linear, unknowns = np.einsum("p,tpif->tif", mass, moved), moved.shape[-1]  # (T, 3, F)
    arms = rotations.skew(np.swapaxes(motion.masses_m[:, 1:-1] - motion.com_m[1:-1], 0, 1))  # (n, N, 3, 3)
    heavy = (mass[:, None, None] * arms).swapaxes(1, 2).reshape(len(arms), 3, -1)  # (n, 3, 3 N)
    count = len(arms)
    rows = []
    for k, factor in enumerate((1.0, -2.0, 1.0)):
        own = moved[k : k + count]
        angular = heavy @ own.reshape(count, -1, unknowns)
        rows.append(factor * np.concatenate((linear[k : k + count], angular), axis=1) / world.sigma[:, None])
    pushed = np.swapaxes(masses.mass_kg[:, None, None] * motion.acceleration, 0, 1)  # (n, N, 3)
    turning = rotations.skew(pushed).swapaxes(1, 2).reshape(count, 3, -1)
    by_arm = turning @ moved[1:-1].reshape(count, -1, unknowns)
    by_com = rotations.skew(pushed.sum(axis=1)) @ (linear[1:-1] * state.dt**2 / masses.total_kg)
    rows[1][:, 3:] += (by_com - by_arm) / world.sigma[3:, None]
    return rows


def _priced(motion: Motion, found: Explained, unit: float, blocks: list[Array]) -> None:
    """Add what the prices of forces curve, by the spheres' places and steps."""
    state, scales = motion.state, motion.world.scales
    priced = motion.priced(found)  # (G, n)
    touching = np.flatnonzero(priced.max(axis=1) > 1e-8)
    if not len(touching):
        return
    touch, skeleton = state.problem.contacts, state.problem.skeleton
    moved = of_points(skeleton, state.pose, touch.segments[touching], motion.touching_m[touching])
    frames = len(moved)
    flat = moved.reshape(frames, -1, FREE)
    along = np.einsum("gti,tgif->tgf", motion.normals[touching], moved)  # (T, G', FREE)
    far = np.maximum(motion.apart_m[touching, 1:-1], 0.0) / scales.distance_m  # (G', n)
    far = np.pad(priced[touching] * np.where(far > 0, 1.0 + 6.0 * far**2, 0.0), ((0, 0), (1, 1)))
    blocks[0] += np.swapaxes(along, 1, 2) @ ((unit / scales.distance_m**2) * far.T[..., None] * along)
    paid = motion.paid_steps(priced[touching]) * unit / (scales.slip_mps * state.dt) ** 2  # (G', T - 1)
    paid = np.repeat(paid.T, 3, axis=1)[..., None]
    blocks[0][1:] += np.swapaxes(flat[1:], 1, 2) @ (paid * flat[1:])
    blocks[0][:-1] += np.swapaxes(flat[:-1], 1, 2) @ (paid * flat[:-1])
    blocks[1][:-1] -= np.swapaxes(flat[1:], 1, 2) @ (paid * flat[:-1])
