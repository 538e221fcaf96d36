"""What the clean references ask for that no body can do: flight that is not free fall, and spin from nothing.

usage: python tools/feasibility.py --data DATA

Of every stretch of frames in which all parts of the body are more than 5 cm over the floor: the time aloft,
the time that the rise of the centre of mass allows, the vertical acceleration (free fall: -9.81 m/s²), and
the angular momentum about the centre of mass, which can't change in flight.
"""

from __future__ import annotations

import argparse
from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np
import references

from simrecon import rollout
from simrecon import scene as scenes
from simrecon.types import Array, KinematicFit, Scene

CLEAR_M, SHORTEST = 0.05, 4
GRAVITY_MPS2 = 9.81


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, required=True)
    options = parser.parse_args()
    print(
        "| clip | aloft, s | rise of the centre of mass, mm | time for that rise and fall, s "
        "| vertical acceleration, m/s² | angular momentum, least and most, kg m²/s |"
    )
    print("|---|---|---|---|---|---|")
    for clip in references.CLIPS:
        fit = references.read(options.data / "mocap" / "deepmimic", clip)
        for first, last in flights(fit):
            print(row(clip, fit, first, last))


def row(clip: str, fit: KinematicFit, first: int, last: int) -> str:
    """One flight, its first and last frames left out of the accelerations."""
    com_m, momentum = motion_of_mass(fit)
    interval_s = float(fit.times_s[1] - fit.times_s[0])
    height = com_m[first : last + 1, 2]
    times_s = np.arange(len(height)) * interval_s
    acceleration = 2.0 * np.polyfit(times_s, height, 2)[0]
    rise, fall = height.max() - height[0], height.max() - height[-1]
    allowed_s = np.sqrt(2.0 * max(rise, 0.0) / GRAVITY_MPS2) + np.sqrt(2.0 * max(fall, 0.0) / GRAVITY_MPS2)
    spin = np.linalg.norm(momentum[first + 1 : last], axis=-1)
    return (
        f"| {clip} | {times_s[-1]:.2f} | {1e3 * rise:.0f} | {allowed_s:.2f} | {acceleration:.1f} "
        f"| {spin.min():.0f}, {spin.max():.0f} |"
    )


def flights(fit: KinematicFit) -> list[tuple[int, int]]:
    """First and last frames of every stretch without support."""
    model = mujoco.MjModel.from_xml_string(scenes.build(fit.body.mjcf, Scene(), 0.01))
    data = mujoco.MjData(model)
    floor = next(i for i in range(model.ngeom) if model.geom_bodyid[i] == 0)
    parts = [i for i in range(model.ngeom) if model.geom_bodyid[i] != 0]
    aloft = np.zeros(len(fit.qpos) + 2, dtype=bool)
    for frame, qpos in enumerate(fit.qpos, start=1):
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        gaps = [mujoco.mj_geomDistance(model, data, floor, part, 1.0, None) for part in parts]
        aloft[frame] = min(gaps) > CLEAR_M
    edges = np.flatnonzero(np.diff(aloft.astype(int)))
    return [(a, b - 1) for a, b in list(pairwise(edges))[::2] if b - a >= SHORTEST]


def motion_of_mass(fit: KinematicFit) -> tuple[Array, Array]:
    """Centre of mass (T, 3), and angular momentum about it (T, 3)."""
    model = mujoco.MjModel.from_xml_string(fit.body.mjcf)
    data = mujoco.MjData(model)
    interval_s = float(fit.times_s[1] - fit.times_s[0])
    com, momentum = [], []
    for qpos, qvel in zip(fit.qpos, rollout.velocities(model, fit.qpos, interval_s), strict=True):
        data.qpos[:], data.qvel[:] = qpos, qvel
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_subtreeVel(model, data)
        com.append(data.subtree_com[1].copy())
        momentum.append(data.subtree_angmom[1].copy())
    return np.array(com), np.array(momentum)


if __name__ == "__main__":
    main()
