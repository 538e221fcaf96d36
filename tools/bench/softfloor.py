"""Recover a floor's known stiffness and damping from the motion of a person who lands on it.

    python -m tools.bench.softfloor [--stiffness 15000] [--ratio 0.3] [--plan quick] [--height 0.15]

A person with bent knees is dropped from a small height on a compliant floor, with motors that hold the pose;
what a perfect 3D estimate would see of that is the evidence. Prints every trial and the result.
"""

from __future__ import annotations

import argparse
import math

import mujoco
import numpy as np

from simrecon import body as bodies
from simrecon import kinematics, softfloor
from simrecon import plan as plans
from simrecon import scene as scenes
from simrecon.geometry import rotations
from simrecon.pipeline import Setup, reconstruct
from simrecon.sim.address import locate
from simrecon.sim.state import component, initial_state, simulate
from simrecon.types import Array, Body, Evidence, Ground, Scene

STEP_S, FRAME_S, SECONDS, SOLE_M = 1 / 240, 1 / 30, 1.2, 0.02


def landing(person: Body, ground: Ground, height_m: float) -> Array:
    """Configurations (T, 71) of the drop."""
    names = person.skeleton.names[1:]
    bend = {"hip": -0.6, "knee": 1.1, "ankle": -0.5}
    turns = np.zeros((len(names), 3))
    for row, name in enumerate(names):
        turns[row, 1] = bend.get(name.split("_")[-1], 0.0)
    joints = rotations.multiply(rotations.conjugate(person.skeleton.rest[1:]), rotations.exp(turns))
    qpos = np.concatenate((np.zeros(3), [1.0, 0.0, 0.0, 0.0], joints.ravel()))
    marks = kinematics.configurations(person, qpos[None])[1][0]
    points = person.skeleton.point_names
    qpos[2] = SOLE_M - min(marks[points.index(f"left_{end}"), 2] for end in ("heel", "toe")) + height_m
    model = mujoco.MjModel.from_xml_string(scenes.build(person.mjcf, Scene(ground), STEP_S))
    state = initial_state(model, np.append(qpos, 0.0), np.zeros(model.nv))
    ctrl = np.tile(rotations.log(joints).ravel(), (round(SECONDS / STEP_S), 1))
    states = simulate(model, state, ctrl)
    qpos = component(model, states, mujoco.mjtState.mjSTATE_QPOS)
    return qpos[:: round(FRAME_S / STEP_S), : locate(model).nq]


def main() -> None:
    """Print the loss curve and the result."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--stiffness", type=float, default=15e3)
    parser.add_argument("--ratio", type=float, default=0.3)
    parser.add_argument("--height", type=float, default=0.15)
    parser.add_argument("--plan", default="quick")
    options = parser.parse_args()
    plan = plans.read(options.plan)
    person = bodies.build(bodies.scaled({}, 1.75), height_m=1.75, mass_kg=70.0, sole_m=SOLE_M)
    damping = options.ratio * 2 * math.sqrt(options.stiffness * 70.0)
    qpos = landing(person, Ground(stiffness_Npm=options.stiffness, damping_Nspm=damping), options.height)
    points = kinematics.configurations(person, qpos)[1]
    frames = len(qpos)
    evidence = Evidence(
        times_s=FRAME_S * np.arange(frames, dtype=float),
        keypoint_names=(),
        keypoints_px=np.zeros((frames, 0, 2)),
        scores=np.zeros((frames, 0)),
        joint_names=person.skeleton.point_names,
        joints_m=points,
        joints_frame="world",
        mass_kg=70.0,
        height_m=1.75,
    )
    scene = Scene(Ground(calibrate=True))
    calibration = softfloor.calibrate(
        lambda trial, start: reconstruct(evidence, trial, plan, Setup(threads=2, start=start)), scene, 70.0
    )
    print(f"truth      {options.stiffness:8.0f} N/m {damping:7.0f} N s/m")
    for trial in calibration.trials:
        values = f"{trial.stiffness_Npm:8.0f} N/m {trial.damping_Nspm:7.0f} N s/m"
        print(f"           {values}   loss {trial.loss:.1f}")
    ground = calibration.ground
    print(f"result     {ground.stiffness_Npm:8.0f} N/m {ground.damping_Nspm:7.0f} N s/m")


if __name__ == "__main__":
    main()
