"""The laws of motion, and what contacts can exert (Rempe 2020, fig. 3)."""

from __future__ import annotations

import casadi as ca
import numpy as np

from simrecon.metrics.dynamics import GRAVITY_MPS2
from simrecon.planners.centroidal.curves import AXES, Symbols
from simrecon.planners.centroidal.laws import Law, grid, interpolated, law, smooth
from simrecon.planners.centroidal.limbs import Limb
from simrecon.planners.centroidal.model import Model
from simrecon.planners.centroidal.rotation import momentum, turning
from simrecon.types import Array


def of_forces(model: Model) -> list[Law]:
    """The laws of motion, and what contacts can exert."""
    times = grid(float(model.inputs.times_s[-1]), model.settings.checks.dynamics_s)
    if model.settings.checks.integral_points:
        laws = [*integrals(model, times), impulses(model, times)]
    else:
        laws = [*forces(model, times), moments(model, times)]
    for limb in model.limbs:
        laws.extend(_pushes(limb, model))
    return [entry for entry in laws if entry.values.shape[0]]


def forces(model: Model, times: Array) -> list[Law]:
    """Forces move the centre of mass, in body weights: r̈ / g + z = Σ f at points, as in the paper."""
    up = ca.DM(np.tile([0.0, 0.0, 1.0], (len(times), 1)))
    left = model.samples.of(model.com, times, 2) / GRAVITY_MPS2 + up - _total(model, times)
    return [smooth(model.com), law("forces", left, 0.0, 0.0, times, model.settings.relaxed.wrench)]


def integrals(model: Model, times: Array) -> list[Law]:
    """The same over the time from each point to the next, h, in body weights.

        (ṙ₁ - ṙ₀) / g h + z = ∫ Σ f ds,   (r₁ - r₀ - h ṙ₀) / g h² + z / 2 = ∫ (1 - s) Σ f ds,   s from 0 to 1.

    Ours: momentum and place at the points are those that the forces give, whenever contacts begin and end.
    """
    count, steps, h = model.settings.checks.integral_points, len(times) - 1, float(times[1] - times[0])
    share = (np.arange(count) + 0.5) / count
    total = _total(model, (times[:-1, None] + h * share).ravel())
    mean, early = (
        ca.DM(np.kron(np.eye(steps), weight[None] / count)) @ total for weight in (np.ones(count), 1 - share)
    )
    place, velocity = model.samples.of(model.com, times), model.samples.of(model.com, times, 1)
    up = ca.DM(np.tile([0.0, 0.0, 1.0], (steps, 1)))
    faster = (velocity[1:, :] - velocity[:-1, :]) / (GRAVITY_MPS2 * h) + up - mean
    farther = place[1:, :] - place[:-1, :] - h * velocity[:-1, :]
    price = model.settings.relaxed.wrench
    return [
        law("forces", faster, 0.0, 0.0, times[1:], price),
        law("forces", farther / (GRAVITY_MPS2 * h**2) + up / 2 - early, 0.0, 0.0, times[1:], price),
    ]


def moments(model: Model, times: Array) -> Law:
    """Forces turn the body, in body weights times a metre.

    I ω̇ + ω × I ω = Rᵀ Σ (p - r) × f m g, on the axes of the root.
    """
    inputs, moment = model.inputs, _moment(model, times)
    inertia = interpolated(inputs.times_s, inputs.inertia.reshape(-1, 9), times) / (
        inputs.mass_kg * GRAVITY_MPS2
    )
    turn, rate, bend = (model.samples.of(model.turn, times, order) for order in range(3))
    turned = turning(inputs.axes)
    left = [
        turned(turn[k, :], rate[k, :], bend[k, :], inertia[k].reshape(3, 3), moment[k, :])
        for k in range(len(times))
    ]
    return law("moments", ca.horzcat(*left).T, 0.0, 0.0, times, model.settings.relaxed.wrench)


def impulses(model: Model, times: Array) -> Law:
    """Moments change the angular momentum from each point to the next, in body weights times a metre.

    (H₁ - H₀) / h = ∫ Σ (p - r) × f ds m g,   H = R (I ω + l),   l that of the limbs against the root. Ours:
    the paper leaves out l, and how I changes; then a kick has to turn the whole body.
    """
    inputs, h, steps = model.inputs, float(times[1] - times[0]), len(times) - 1
    count = (model.settings.checks.integral_points + 1) // 2
    inner = (times[:-1, None] + h * (np.arange(count) + 0.5) / count).ravel()
    mean = ca.DM(np.kron(np.eye(steps), np.full((1, count), 1 / count)))
    weight_N = inputs.mass_kg * GRAVITY_MPS2
    inertia = interpolated(inputs.times_s, inputs.inertia.reshape(-1, 9), times) / weight_N
    swing = interpolated(inputs.times_s, inputs.swing, times) / weight_N
    turn, rate = (model.samples.of(model.turn, times, order) for order in range(2))
    of = momentum(inputs.axes)
    held = [
        of(turn[k, :], rate[k, :], inertia[k].reshape(3, 3), swing[k].reshape(1, 3))
        for k in range(len(times))
    ]
    gained = ca.horzcat(*held).T
    left = (gained[1:, :] - gained[:-1, :]) / h - mean @ _moment(model, inner)
    return law("moments", left, 0.0, 0.0, times[1:], model.settings.relaxed.wrench)


def _moment(model: Model, times: Array) -> Symbols:
    """Sum of the moments of all forces about the centre of mass at times (N,), (N, 3)."""
    com, moment = model.samples.of(model.com, times), ca.SX.zeros(len(times), AXES)
    for limb in model.limbs:
        place, force = (model.samples.of(curve, times) for curve in (limb.place, limb.force))
        moment += _crossed(place - com, force)
    return moment


def _total(model: Model, times: Array) -> Symbols:
    """Sum of all forces at times (N,), (N, 3), in body weights."""
    total = ca.SX.zeros(len(times), AXES)
    for limb in model.limbs:
        total += model.samples.of(limb.force, times)
    return total


def _pushes(limb: Limb, model: Model) -> list[Law]:
    """Forces push, not too much, and stay in the friction pyramid.

    It holds for the Bézier points of every cubic, and so at all times, since a cubic is in their hull.
    """
    settings = model.settings.forces
    most = settings.most_N / settings.reference_kg / GRAVITY_MPS2
    curve, laws = limb.force, []
    for row, (phase, plane) in enumerate(zip(limb.phases, limb.target.touching.planes, strict=True)):
        if not phase.contact:
            continue
        own = np.flatnonzero(limb.force_phase == row)
        first, last, h = curve.first[own].tolist(), curve.last[own].tolist(), curve.lengths[own.tolist(), :]
        third = ca.repmat(h / 3, 1, AXES)
        after = curve.values[first, :] + third * curve.rates[first, :]
        before = curve.values[last, :] - third * curve.rates[last, :]
        points = ca.vertcat(curve.values[[*first, last[-1]], :], after, before)
        starts = curve.edges_s[own]
        times = np.concatenate((starts, curve.edges_s[own[-1:] + 1], starts, starts))
        along = points @ ca.DM(plane.normal)
        friction = min(settings.friction, plane.friction)
        laws.append(law("push", along, 0.0, most, times))
        for tangent in plane.tangents:
            across = points @ ca.DM(tangent)
            laws.append(law("friction", friction * along - across, 0.0, np.inf, times))
            laws.append(law("friction", friction * along + across, 0.0, np.inf, times))
    return laws


def _crossed(a: Symbols, b: Symbols) -> Symbols:
    """Cross products of rows (N, 3)."""
    columns = ((1, 2), (2, 0), (0, 1))
    return ca.horzcat(*(a[:, i] * b[:, j] - a[:, j] * b[:, i] for i, j in columns))
