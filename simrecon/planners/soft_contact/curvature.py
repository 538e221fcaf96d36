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
from simrecon.kinematics.jacobian import of_points
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
            blocks = _blocks(motion, _part(found, near), planned.weight * problem.dt)
            added = [block + more[own][: len(block)] for block, more in zip(part.blocks, blocks, strict=True)]
            part = replace(part, blocks=(added[0], added[1], added[2]))
        yield part
        start = stop


def _part(found: Explained, near: slice) -> Explained:
    """Of the frames that have an acceleration among those near."""
    rows = slice(near.start, near.stop - REACH)
    return Explained(found.forces[rows], found.residual[rows], found.stiffness[rows])


def _blocks(motion: Motion, found: Explained, unit: float) -> list[Array]:
    """Blocks of frame t + k with frame t, (T, FREE, FREE) each, zero where the clip ends."""
    frames = motion.masses_m.shape[1]
    blocks = [np.zeros((frames, FREE, FREE)) for _ in range(REACH + 1)]
    masses, state = motion.world.masses, motion.state
    moved = of_points(state.problem.skeleton, state.pose, masses.segments, motion.masses_m)  # (T, N, 3, FREE)
    rows = _by_unknowns(motion, moved)  # of frame t - 1, t and t + 1, (n, 6, FREE) each
    rough = steady.rate_curvature(motion.world.change(motion.state.dt))
    weighted = [unit * (np.linalg.solve(found.stiffness, row) + rough * row) for row in rows]
    for i in range(REACH + 1):
        for j in range(i + 1):
            blocks[i - j][j : j + frames - 2] += np.swapaxes(rows[i], 1, 2) @ weighted[j]
    _priced(motion, found, unit, blocks)
    centre = np.einsum("p,tpif->tif", masses.mass_kg / masses.total_kg, moved)  # (T, 3, FREE)
    blocks[0] += unit / motion.world.scales.place_m**2 * (np.swapaxes(centre, 1, 2) @ centre)
    return blocks


def _by_unknowns(motion: Motion, moved: Array) -> list[Array]:
    """Derivative of the wrench (n, 6) by the unknowns of the frame before, its own and the one after.

    Args:
        motion: of T frames.
        moved: (T, N, 3, FREE) derivative of the point masses.
    """
    state, world = motion.state, motion.world
    masses = world.masses
    mass = masses.mass_kg / state.dt**2
    linear = np.einsum("p,tpif->tif", mass, moved)  # (T, 3, FREE)
    arms = rotations.skew(np.swapaxes(motion.masses_m[:, 1:-1] - motion.com_m[1:-1], 0, 1))  # (n, N, 3, 3)
    heavy = (mass[:, None, None] * arms).swapaxes(1, 2).reshape(len(arms), 3, -1)  # (n, 3, 3 N)
    count = len(arms)
    rows = []
    for k, factor in enumerate((1.0, -2.0, 1.0)):
        own = moved[k : k + count]
        angular = heavy @ own.reshape(count, -1, FREE)
        rows.append(factor * np.concatenate((linear[k : k + count], angular), axis=1) / world.sigma[:, None])
    pushed = np.swapaxes(masses.mass_kg[:, None, None] * motion.acceleration, 0, 1)  # (n, N, 3)
    turning = rotations.skew(pushed).swapaxes(1, 2).reshape(count, 3, -1)
    by_arm = turning @ moved[1:-1].reshape(count, -1, FREE)
    by_com = rotations.skew(pushed.sum(axis=1)) @ (linear[1:-1] * state.dt**2 / masses.total_kg)
    rows[1][:, 3:] += (by_com - by_arm) / world.sigma[3:, None]
    return rows


def _priced(motion: Motion, found: Explained, unit: float, blocks: list[Array]) -> None:
    """Add what the prices of forces curve, by the spheres' places and steps."""
    state, scales = motion.state, motion.world.scales
    priced = np.sum(np.swapaxes(found.forces, 0, 1) ** 2, axis=2) / motion.world.weight_N**2  # (G, n)
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
