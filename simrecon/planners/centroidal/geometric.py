"""Constraints on where the body and its points are (Rempe 2020, fig. 3)."""

from __future__ import annotations

import casadi as ca
import numpy as np

from simrecon.metrics.dynamics import GRAVITY_MPS2
from simrecon.planners.centroidal.curves import Samples, Symbols
from simrecon.planners.centroidal.inputs import Inputs
from simrecon.planners.centroidal.laws import Law, grid, interpolated, law, smooth
from simrecon.planners.centroidal.limbs import Limb
from simrecon.planners.centroidal.model import Model
from simrecon.planners.centroidal.rotation import rotation
from simrecon.types import Array

VELOCITIES = "velocity boundaries"


def of_motion(model: Model) -> list[Law]:
    """Those that need no forces."""
    duration = float(model.inputs.times_s[-1])
    checks = model.settings.checks
    lengths, heights = grid(duration, checks.lengths_s), grid(duration, checks.heights_s)
    laws = [smooth(model.turn), *_velocities(model), *_feet(model, lengths)]
    hold = rotation(model.inputs.axes)
    turn, com = (model.samples.of(curve, lengths) for curve in (model.turn, model.com))
    for limb in model.limbs:
        place = model.samples.of(limb.place, lengths)
        laws.append(_limb(limb, place, com, turn, hold, model.inputs, lengths))
        laws.extend(_surface(limb, model.samples, heights, model.inputs.times_s))
    return [entry for entry in laws if entry.values.shape[0]]


def ordered(model: Model) -> list[Law]:
    """Phases whose ends are free keep some length."""
    least = model.settings.durations.shortest_s
    laws = []
    for limb, ends in zip(model.limbs, model.ends, strict=True):
        if len(limb.phases) > 1:
            all_ = ca.vertcat(0.0, ends, limb.phases[-1].end_s)
            times = np.array([phase.end_s for phase in limb.phases])
            laws.append(law("durations", all_[1:] - all_[:-1], least, np.inf, times))
    return laws


def _velocities(model: Model) -> list[Law]:
    """The plan begins and ends with the mean velocity of some frames (C.2)."""
    inputs = model.inputs
    ends = boundary_velocities(inputs, model.settings.checks.velocity_frames)
    times = (0.0, float(inputs.times_s[-1]))
    return [
        law(
            VELOCITIES, model.com.at(np.array([t]), 1) - ca.DM(v).T, 0.0, 0.0, np.array([t]),
            model.settings.relaxed.velocity,
        )
        for t, v in zip(times, ends, strict=True)
        if v is not None
    ]  # fmt: skip


def boundary_velocities(inputs: Inputs, frames: int) -> tuple[Array | None, Array | None]:
    """Velocity (3,) at the beginning and at the end; None of a clip without contact.

    Of a clip that begins or ends in flight it is that of the parabola.
    """
    contact = np.zeros(len(inputs.times_s), bool)
    for target in inputs.targets:
        for phase in target.touching.phases:
            contact |= phase.contact & phase.frames(inputs.times_s)
    if not contact.any():
        return None, None
    count = min(frames, len(contact)) - 1
    span = count * inputs.frame_s
    start = (inputs.com_m[count] - inputs.com_m[0]) / span
    end = (inputs.com_m[-1] - inputs.com_m[-1 - count]) / span
    fall = np.array([0.0, 0.0, GRAVITY_MPS2 * span / 2])
    if not contact[: count + 1].any():
        start = start + fall
    if not contact[-1 - count :].any():
        end = end - fall
    return start, end


def _feet(model: Model, times: Array) -> list[Law]:
    """Heel and toe keep their distance; once for places that both stay."""
    laws = []
    for i, j in model.inputs.pairs:
        a, b = model.limbs[i], model.limbs[j]
        length = float(np.linalg.norm(a.target.point.offset_m - b.target.point.offset_m))
        rest = np.stack((a.contact(times), b.contact(times)))
        both = (rest >= 0).all(axis=0)
        _, first = np.unique(rest[:, both], axis=1, return_index=True)
        at = np.sort(np.concatenate((times[~both], times[both][first])))
        apart = model.samples.of(a.place, at) - model.samples.of(b.place, at)
        laws.append(law("foot length", ca.sum2(apart * apart) / length**2, 1.0, 1.0, at))
    return laws


def _limb(
    limb: Limb, place: Symbols, com: Symbols, turn: Symbols, hold: ca.Function, inputs: Inputs, times: Array
) -> Law:
    """No point is farther from its hip than the leg is long."""
    anchors = interpolated(inputs.times_s, limb.target.anchor_m, times)
    hips = [com[k, :].T + hold(turn[k, :]) @ ca.DM(anchors[k]) for k in range(len(times))]
    apart = place - ca.horzcat(*hips).T
    name = f"reach of the {limb.target.point.name.replace('_', ' ')}"
    return law(name, ca.sum2(apart * apart) / limb.target.point.reach_m**2, 0.0, 1.0, times)


def _surface(limb: Limb, samples: Samples, times: Array, frames_s: Array) -> list[Law]:
    """A point is on what it touches, and elsewhere not below what is nearest."""
    touching, label = limb.target.touching, limb.target.point.name.replace("_", " ")
    laws = []
    for row, (phase, plane) in enumerate(zip(limb.phases, touching.planes, strict=True)):
        if phase.contact:
            piece = np.flatnonzero(limb.place_phase == row)[:1]
            at = np.array([(phase.start_s + phase.end_s) / 2])
            off = samples.of(limb.place, at, 0, piece) @ ca.DM(plane.normal) - plane.height_m
            laws.append(law(f"{label} on the floor", off, 0.0, 0.0, at))
    flying = times[limb.contact(times) < 0]
    if len(flying):
        frames = np.abs(flying[:, None] - frames_s).argmin(axis=1)
        normals, heights = touching.normals[frames], touching.heights_m[frames]
        over = ca.sum2(samples.of(limb.place, flying) * ca.DM(normals)) - ca.DM(heights)
        laws.append(law(f"{label} above the floor", over, 0.0, np.inf, flying))
    return laws
