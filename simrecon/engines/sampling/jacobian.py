"""The slope of the loss of a window: J Jᵀ and J r of its residuals, from derivatives of every step.

The chain runs forward: `sim.derivatives` says how the acceleration of a step depends on state and control, S
is how the state depends on the unknowns so far, and at the frames that the loss looks at S meets the slopes
of its terms (`optim.banded`). Only the columns of knots that have begun to act are carried.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon.engines.sampling.task import Task
from simrecon.engines.sampling.terms import DIFFERENCES, Moves
from simrecon.optim.banded import Banded, Single
from simrecon.sim.derivatives import PointSlopes, Transitions, by_offset
from simrecon.sim.poses import posed
from simrecon.sim.rollout import Rollouts, Simulator
from simrecon.sim.state import qpos_of, simulate
from simrecon.types import Array

JACOBIAN_MAX = 1e4
"""An unknown of which the residuals are more sensitive is left out: it says nothing of the slope."""


@dataclass(frozen=True, eq=False)
class Linearised:
    """The weighted residuals r (R,) near a point, with J (n, R) their derivatives in units of deviations.

    Attributes:
        curvature: (n, n) J Jᵀ. gradient: (n,) J r.
    """

    curvature: Array
    gradient: Array


def linearise(task: Task, simulator: Simulator, x: Array, scale: Array) -> Linearised:
    """The slopes of a window's residuals.

    Args:
        task: the window.
        simulator: has the threads.
        x: (n,) unknowns.
        scale: (n,) their deviations.
    """
    state, ctrl = task.states(x[None])[0], task.control(x[None])[0, :-1]
    states = simulate(simulator.model, state, ctrl)
    qpos = qpos_of(simulator.model, states)[task.at_steps]
    banded = _of_frames(task, simulator, qpos, _wrenches(task, simulator, x))
    steps = simulator.transitions(states, ctrl)
    curvature, gradient = banded.squares(_moves(task, simulator, x, scale, steps))
    return _guarded(curvature, gradient)


def _wrenches(task: Task, simulator: Simulator, x: Array) -> Array:
    """On the bodies that are felt at the frames of the loss, (1, F, K, 6)."""
    if not simulator.felt.bodies:
        return np.zeros((1, len(task.at_steps), 0, 6))
    return simulator.run(task.states(x[None]), task.control(x[None]), task.at_steps).wrenches


def _of_frames(task: Task, simulator: Simulator, qpos: Array, wrenches: Array) -> Banded:
    """The terms of the loss around configurations (F, nq) and wrenches (1, F, K, 6) of its frames."""
    model, person = simulator.model, simulator.person
    rows = task.problem.point_rows
    slopes = PointSlopes(model, simulator.inverse.tree, rows, person.body)
    points, com = np.empty((len(qpos), model.nsite, 3)), np.empty((len(qpos), 3))
    by_point, by_com = np.empty((len(qpos), len(rows), 3, model.nv)), np.empty((len(qpos), 3, model.nv))
    for frame, data in enumerate(posed(model, qpos)):
        points[frame], com[frame] = data.site_xpos, data.subtree_com[person.body]
        by_point[frame], by_com[frame] = slopes.at(data)
    finite = np.ones(1, np.bool_)
    seen = task.seen(Rollouts(qpos[None, :, person.qpos], points[None], com[None], finite, wrenches))
    moves = Moves.of(by_com, by_point, person, wrenches.shape[2])
    size = moves.com.shape[-1]
    banded = Banded(len(qpos), size, DIFFERENCES)
    for term in task.terms:
        residual = term.residual(seen)
        vectors = residual.vectors[0]
        if not len(vectors):  # differences of more frames than there are
            continue
        weights = np.broadcast_to(residual.roots() ** 2, vectors.shape)
        count = len(vectors)
        banded.add(
            term.slope(seen, moves).reshape(len(qpos), -1, size),
            vectors.reshape(count, -1),
            weights.reshape(count, -1),
        )
    return banded


def _moves(task: Task, simulator: Simulator, x: Array, scale: Array, parts: list[Transitions]) -> Single:
    """How positions and wrenches at the loss's frames depend on the unknowns, in deviations: (F, V, n)."""
    nu, nv = simulator.model.nu, simulator.model.nv
    felt = np.zeros((6 * len(simulator.felt.bodies), len(x)), np.float32)  # sum since the frame before
    weights = task.knot_weights()  # (N, Q)
    knots = weights.shape[1] * nu
    free = len(x) - knots  # the unknowns of the first state come first here
    tangents = np.zeros((2 * nv, len(x)), np.float32)
    tangents[:, :free] = _of_start(simulator, x[knots:], scale[knots:])
    frames = {step: frame for frame, step in enumerate(task.at_steps.tolist())}
    moves = np.zeros((len(frames), nv + len(felt), len(x)), np.float32)
    moves[frames.get(0, 0), :nv] = tangents[:nv]
    lengths = dict(zip(task.at_steps[1:].tolist(), np.diff(task.at_steps).tolist(), strict=True))
    steps = (own for part in parts for own in zip(part.state, part.control, part.wrench, strict=True))
    for step, (by_state, by_control, by_both) in enumerate(steps):
        acting = np.flatnonzero(weights[step])
        end = free + nu * (int(acting[-1]) + 1 if len(acting) else 0)
        felt[:, :end] += by_both[:, : 2 * nv] @ tangents[:, :end]
        tangents[:, :end] = by_state @ tangents[:, :end]
        for knot in acting.tolist():
            column = knot * nu
            own = (weights[step, knot] * scale[column : column + nu]).astype(np.float32)
            tangents[:, free + column : free + column + nu] += by_control * own
            felt[:, free + column : free + column + nu] += by_both[:, 2 * nv :] * own
        if step + 1 in frames:
            moves[frames[step + 1], :nv, :end] = tangents[:nv, :end]
            moves[frames[step + 1], nv:, :end] = felt[:, :end] / lengths[step + 1]
            felt[:] = 0.0
    return np.concatenate((moves[..., free:], moves[..., :free]), axis=-1)


def _of_start(simulator: Simulator, x: Array, scale: Array) -> Array:
    """How the first state depends on its unknowns x, pose and velocity of the person: (2 V, len(x))."""
    nv, own = simulator.model.nv, len(x) // 2
    tangents = np.zeros((2 * nv, len(x)))
    offset, first = np.zeros((1, nv)), np.arange(own)
    offset[0, :own] = x[:own]
    unit = np.zeros((1, nv, own))
    unit[0, first, first] = scale[:own]
    tangents[:nv, :own] = by_offset(simulator.inverse.tree, offset, unit)[0]
    tangents[nv + first, own + first] = scale[own:]
    return tangents


def _guarded(curvature: Array, gradient: Array) -> Linearised:
    """Both without the unknowns of which too much is said."""
    squares = curvature.diagonal()
    valid = np.isfinite(gradient) & (squares < JACOBIAN_MAX**2)
    gradient = np.where(valid, gradient, 0.0)
    return Linearised(np.where(np.outer(valid, valid), curvature, 0.0), gradient)
