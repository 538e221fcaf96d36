"""Physics of the scene against formulas: what a floor in N/m does, and whether forces balance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.optimize import brentq, curve_fit

from simrecon import body as bodies
from simrecon import scene as scenes
from simrecon.body.primitives import FEET
from simrecon.evaluation import loads
from simrecon.geometry import rotations
from simrecon.sim.models import compile_text
from simrecon.sim.poses import posed
from simrecon.sim.state import initial_state
from simrecon.types import Array, Body, Ground, Scene, SceneItem

GRAVITY = 9.81
HALF_M = 0.15
SETTLE_S, MEAN_S = 2.0, 0.5
_SEAT = ("pelvis", "left_buttock", "right_buttock", "left_thigh", "right_thigh")


@dataclass(frozen=True)
class Measured:
    """A measured number beside the one that a formula gives."""

    measured: float
    expected: float
    unit: str


def sink(*, mass_kg: float, stiffness_Npm: float, timestep_s: float) -> Measured:
    """How far a block at rest has sunk into a compliant floor: m g / k."""
    damping = 1.4 * np.sqrt(stiffness_Npm * mass_kg)
    path = _swing(mass_kg, stiffness_Npm, damping, timestep_s)
    return Measured(1e3 * float(path[-1]), 1e3 * mass_kg * GRAVITY / stiffness_Npm, "mm")


def period(*, mass_kg: float, stiffness_Npm: float, damping_Nspm: float, timestep_s: float) -> Measured:
    """Period of a block that swings on a compliant floor: 2π / √(k/m - (c/2m)²)."""
    _, turn = _fitted(mass_kg, stiffness_Npm, damping_Nspm, timestep_s)
    return Measured(2 * np.pi / turn, 2 * np.pi / _pulse(mass_kg, stiffness_Npm, damping_Nspm), "s")


def decay(*, mass_kg: float, stiffness_Npm: float, damping_Nspm: float, timestep_s: float) -> Measured:
    """Decay rate of the same swing: c / 2m."""
    rate, _ = _fitted(mass_kg, stiffness_Npm, damping_Nspm, timestep_s)
    return Measured(rate, damping_Nspm / (2 * mass_kg), "1/s")


def standing(*, mass_kg: float, height_m: float, timestep_s: float) -> Measured:
    """Total vertical force on a person who stands still: the weight."""
    person = _person(mass_kg, height_m)
    force = _held(person, _upright(person), Scene(), timestep_s)
    return Measured(float(force.sum(axis=0)[2]), mass_kg * GRAVITY, "N")


def sitting(*, mass_kg: float, height_m: float, timestep_s: float) -> Measured:
    """Vertical forces of seat and floor on a person who sits still, both of which bear: the weight."""
    person = _person(mass_kg, height_m)
    qpos = _pose(person, flexed_rad=np.pi / 2)
    force = _held(person, qpos, Scene(items=(_seat(person, qpos),)), timestep_s)  # (2, 3)
    return Measured(float(force.sum(axis=0)[2]), mass_kg * GRAVITY, "N")


CHECKS: dict[str, Callable[..., Measured]] = {
    "sink": sink,
    "period": period,
    "decay": decay,
    "standing": standing,
    "sitting": sitting,
}
"""By name, as in `[[check]]` of a suite."""


def _swing(mass_kg: float, stiffness: float, damping: float, timestep_s: float) -> Array:
    """How far the underside of a block is below z = 0 after every step of 3 s; put down without speed."""
    block = f"""
<mujoco>
  <option integrator="discrete"/>
  <worldbody>
    <body name="block" pos="0 0 {HALF_M}">
      <freejoint/>
      <geom name="block" type="box" size="{HALF_M} {HALF_M} {HALF_M}" mass="{mass_kg}"/>
    </body>
  </worldbody>
</mujoco>
"""
    floor = Scene(Ground(stiffness_Npm=stiffness, damping_Nspm=damping))
    model = compile_text(scenes.build(block, floor, timestep_s))
    data = mujoco.MjData(model)
    depth_m = np.empty(round(3.0 / timestep_s))
    for step in range(len(depth_m)):
        mujoco.mj_step(model, data)
        depth_m[step] = HALF_M - data.qpos[2]
    return depth_m


def _pulse(mass_kg: float, stiffness: float, damping: float) -> float:
    return float(np.sqrt(stiffness / mass_kg - (damping / (2 * mass_kg)) ** 2))


def _fitted(mass_kg: float, stiffness: float, damping: float, timestep_s: float) -> tuple[float, float]:
    """Decay rate and angular frequency of a swing, by least squares."""
    depth_m = _swing(mass_kg, stiffness, damping, timestep_s)
    times = timestep_s * np.arange(1, len(depth_m) + 1)

    def model(t: Array, rest: float, size: float, rate: float, turn: float, phase: float) -> Array:
        return np.asarray(rest + size * np.exp(-rate * t) * np.cos(turn * t + phase))

    rest = mass_kg * GRAVITY / stiffness
    start = (rest, -rest, damping / (2 * mass_kg), _pulse(mass_kg, stiffness, damping), 0.0)
    (_, _, rate, turn, _), _ = curve_fit(model, times, depth_m, start)
    return float(rate), float(turn)


def _person(mass_kg: float, height_m: float) -> Body:
    return bodies.build(bodies.scaled({}, height_m), height_m=height_m, mass_kg=mass_kg, sole_m=0.02)


def _pose(person: Body, *, flexed_rad: float = 0.0, lean_rad: float = 0.0) -> Array:
    """Configuration with hips and knees flexed alike, leaning forward from the ankles, soles on z = 0."""
    names = person.skeleton.names[1:]
    by_name = {"hip": (0, -flexed_rad, 0), "knee": (0, flexed_rad, 0), "ankle": (0, -lean_rad, 0)}
    turns = np.array([by_name.get(name.split("_")[-1], (0, 0, 0)) for name in names], float)
    for side, sign in (("left", -1.0), ("right", 1.0)):
        turns[names.index(f"{side}_shoulder"), 0] = sign * 1.3  # arms down
    joints = rotations.multiply(rotations.conjugate(person.skeleton.rest[1:]), rotations.exp(turns))
    qpos = np.concatenate((np.zeros(3), rotations.exp(np.array([0.0, lean_rad, 0.0])), joints.ravel()))
    model, data = _placed(person, qpos)
    feet = [model.geom(foot).id for foot in FEET]
    qpos[2] = -_lowest(model, data, feet)
    return qpos


def _upright(person: Body) -> Array:
    """Standing straight with the centre of mass over the ankles, so that these have nothing to hold."""

    def ahead(lean_rad: float) -> float:
        model, data = _placed(person, _pose(person, lean_rad=lean_rad))
        ankles = [model.body(f"{side}_ankle").id for side in ("left", "right")]
        return float(data.subtree_com[1, 0] - data.xpos[ankles, 0].mean())

    return _pose(person, lean_rad=float(brentq(ahead, -0.3, 0.3)))


def _placed(person: Body, qpos: Array) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = compile_text(person.mjcf)
    return model, next(posed(model, qpos[None]))


def _lowest(model: mujoco.MjModel, data: mujoco.MjData, geoms: list[int]) -> float:
    """Height of the lowest point of capsules and boxes."""
    upward = np.abs(data.geom_xmat[geoms].reshape(-1, 3, 3)[:, 2])  # (G, 3)
    size, capsule = model.geom_size[geoms], model.geom_type[geoms] == mujoco.mjtGeom.mjGEOM_CAPSULE
    reach = np.where(capsule, size[:, 0] + upward[:, 2] * size[:, 1], (upward * size).sum(axis=1))
    return float((data.geom_xpos[geoms, 2] - reach).min())


def _seat(person: Body, qpos: Array) -> SceneItem:
    """A box that fits under pelvis and thighs, its front edge under the middle of the thighs."""
    model, data = _placed(person, qpos)
    top = _lowest(model, data, [model.geom(name).id for name in _SEAT])
    front = float(data.geom("left_thigh").xpos[0])
    table = {"name": "seat", "kind": "box", "position_m": [front - 0.25, 0.0, 0.0], "size_m": [0.5, 0.8, top]}
    return scenes.item(table, "seat")


def _held(person: Body, qpos: Array, scene: Scene, timestep_s: float) -> Array:
    """Mean force of items and ground (I + 1, 3) on a person who holds a pose, after it has come to rest."""
    model = compile_text(scenes.build(person.mjcf, scene, timestep_s))
    state = initial_state(model, qpos, np.zeros(model.nv))
    target = rotations.log(qpos[7:].reshape(-1, 4)).ravel()  # (nu,)
    steps = round((SETTLE_S + MEAN_S) / timestep_s)
    rows = loads.forces(model, scene, state, np.tile(target, (steps, 1)))
    return np.asarray(rows[-round(MEAN_S / timestep_s) :].mean(axis=0))
