"""What the clean references ask for that no body can do: flight that is not free fall, and spin from nothing.

usage: python -m tools.study.feasibility --data DATA

Of every stretch of frames in which all parts of the body are more than 5 cm over the floor: the time aloft,
the time that the rise of the centre of mass allows, the vertical acceleration (free fall: -9.81 m/s²), and
the angular momentum about the centre of mass, which can't change in flight. Of all other frames: how far the
centre of pressure that the motion asks for lies outside of what is within 5 cm of the floor, and the share of
frames that ask for more friction than there is. Of all frames: the vertical acceleration from one to the
next, and how far the centre of mass has to move at least so that gravity and friction allow what it does.
"""

from __future__ import annotations

import argparse
from itertools import product
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy import optimize, sparse
from scipy.signal import savgol_filter
from scipy.spatial import ConvexHull

from simrecon import scene as scenes
from simrecon.sim.poses import differentiate
from simrecon.types import Array, KinematicFit, Scene, runs
from tools.bench import references

CLEAR_M, SHORTEST = 0.05, 4
GRAVITY_MPS2 = 9.81
FRICTION, LEAST_LOAD = 0.9, 0.2
SMOOTH = 7
"""Frames of the parabolas that give accelerations."""


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, required=True)
    options = parser.parse_args()
    folder = options.data / "mocap" / "deepmimic"
    fits = {clip: references.read(folder, clip) for clip in references.CLIPS}
    print(
        "| clip | aloft, s | rise of the centre of mass, mm | time for that rise and fall, s "
        "| vertical acceleration, m/s² | angular momentum, least and most, kg m²/s |"
    )
    print("|---|---|---|---|---|---|")
    for clip, fit in fits.items():
        for first, last in flights(fit):
            print(row(clip, fit, first, last))
    print("\n| clip | centre of pressure outside of the support, mean and most, mm | friction above 0.9, % |")
    print("|---|---|---|")
    for clip, fit in fits.items():
        outside_m, friction = pressure(fit)
        share = 100 * float((friction > FRICTION).mean())
        print(f"| {clip} | {1e3 * outside_m.mean():.0f}, {1e3 * outside_m.max():.0f} | {share:.0f} |")
    print(
        "\n| clip | vertical acceleration, least and most, g "
        "| least displacement of the centre of mass, mean and most, mm |"
    )
    print("|---|---|---|")
    for clip, fit in fits.items():
        vertical = accelerations(fit)[:, 2] / GRAVITY_MPS2
        moved_mm = 1e3 * np.linalg.norm(nearest(fit) - fit.com_m, axis=1)
        print(
            f"| {clip} | {vertical.min():.1f}, {vertical.max():.1f} "
            f"| {moved_mm.mean():.1f}, {moved_mm.max():.0f} |"
        )


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
    return [(run.start, run.stop - 1) for run in runs(aloft(fit)) if run.stop - run.start >= SHORTEST]


def aloft(fit: KinematicFit) -> NDArray[np.bool_]:
    """Frames (T,) in which all parts are clear of the floor."""
    model = mujoco.MjModel.from_xml_string(scenes.build(fit.body.mjcf, Scene(), 0.01))
    data = mujoco.MjData(model)
    floor = next(i for i in range(model.ngeom) if model.geom_bodyid[i] == 0)
    parts = [i for i in range(model.ngeom) if model.geom_bodyid[i] != 0]
    clear = np.zeros(len(fit.qpos), dtype=bool)
    for frame, qpos in enumerate(fit.qpos):
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        gaps = [mujoco.mj_geomDistance(model, data, floor, part, 1.0, None) for part in parts]
        clear[frame] = min(gaps) > CLEAR_M
    return clear


def accelerations(fit: KinematicFit) -> Array:
    """Of the centre of mass (T - 2, 3), by second differences of its frames, m/s²."""
    interval_s = float(fit.times_s[1] - fit.times_s[0])
    return np.asarray(np.diff(fit.com_m, n=2, axis=0)) / interval_s**2


def nearest(fit: KinematicFit) -> Array:
    """The centre of mass (T, 3) of least mean distance whose accelerations forces on the floor may cause.

    They are gravity's in frames without support, else within the friction cone over it; a linear programme
    with a pyramid around the cone, and distances along 26 directions: the result is a little too near.
    """
    count, interval_s = len(fit.com_m), float(fit.times_s[1] - fit.times_s[0])
    free = aloft(fit)[1:-1]
    second = sparse.diags_array([1.0, -2.0, 1.0], offsets=[0, 1, 2], shape=(count - 2, count)) / interval_s**2
    unit, nothing = sparse.eye_array(count), sparse.csr_array((count - 2, count))
    held, gravity = second.tocsr()[~free], FRICTION * GRAVITY_MPS2 * np.ones((~free).sum())
    rows, most = [], []
    for angle in np.arange(8) * np.pi / 4:
        x, y = np.cos(angle), np.sin(angle)
        rows.append(sparse.hstack([x * held, y * held, -FRICTION * held, nothing[~free]]))
        most.append(gravity)
    for direction in np.array([d for d in product((-1.0, 0.0, 1.0), repeat=3) if any(d)]):
        x, y, z = direction / np.linalg.norm(direction)
        rows.append(sparse.hstack([x * unit, y * unit, z * unit, -unit]))
        most.append(fit.com_m @ [x, y, z])
    falling = sparse.block_diag([second.tocsr()[free]] * 3)
    solution = optimize.linprog(
        np.repeat([0.0, 1.0], [3 * count, count]),
        A_ub=sparse.vstack(rows),
        b_ub=np.concatenate(most),
        A_eq=sparse.hstack([falling, sparse.csr_array((falling.shape[0], count))]),
        b_eq=np.repeat([0.0, 0.0, -GRAVITY_MPS2], free.sum()),
        bounds=(None, None),
    )
    return np.asarray(solution.x[: 3 * count].reshape(3, count).T)


def pressure(fit: KinematicFit) -> tuple[Array, Array]:
    """Distance (S,) of the implied centre of pressure from the support, m, and implied friction (S,).

    S frames with a support and an implied vertical force above `LEAST_LOAD` of the weight. With the force f
    and the rate of angular momentum L' about the centre of mass c, the centre of pressure on the floor is
    c_xy - (f_xy c_z + (L'_y, -L'_x)) / f_z.
    """
    com_m, momentum = motion_of_mass(fit)
    interval_s = float(fit.times_s[1] - fit.times_s[0])
    acceleration = savgol_filter(com_m, SMOOTH, 3, deriv=2, delta=interval_s, axis=0)
    turning = savgol_filter(momentum, SMOOTH, 3, deriv=1, delta=interval_s, axis=0)
    model = mujoco.MjModel.from_xml_string(scenes.build(fit.body.mjcf, Scene(), 0.01))
    weight = float(model.body_subtreemass[1]) * GRAVITY_MPS2
    force = weight / GRAVITY_MPS2 * (acceleration + np.array([0.0, 0.0, GRAVITY_MPS2]))
    at = com_m[:, :2] - (com_m[:, 2:] * force[:, :2] + turning[:, 1::-1] * [1.0, -1.0]) / force[:, 2:]
    data = mujoco.MjData(model)
    outside, friction = [], []
    for frame in np.flatnonzero(force[:, 2] > LEAST_LOAD * weight):
        data.qpos[:] = fit.qpos[frame]
        mujoco.mj_kinematics(model, data)
        points = np.concatenate([lowest(model, data, i) for i in range(model.ngeom) if model.geom_bodyid[i]])
        near = points[points[:, 2] < CLEAR_M, :2]
        if len(near) > 2:
            sides = ConvexHull(near).equations
            outside.append(max(float((sides[:, :2] @ at[frame] + sides[:, 2]).max()), 0.0))
            friction.append(float(np.linalg.norm(force[frame, :2]) / force[frame, 2]))
    return np.array(outside), np.array(friction)


def lowest(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Array:
    """Points (K, 3) of a primitive that may touch the floor: a box's corners, low points of round ends."""
    size, at, turn = model.geom_size[geom], data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX:
        corners = np.array(list(product((-1.0, 1.0), repeat=3)))
        return np.asarray(at + (corners * size) @ turn.T)
    half = size[1] if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CAPSULE else 0.0
    ends = at + np.array([[0.0, 0.0, -half], [0.0, 0.0, half]]) @ turn.T
    return np.asarray(ends - np.array([0.0, 0.0, size[0]]))


def motion_of_mass(fit: KinematicFit) -> tuple[Array, Array]:
    """Centre of mass (T, 3), and angular momentum about it (T, 3)."""
    model = mujoco.MjModel.from_xml_string(fit.body.mjcf)
    data = mujoco.MjData(model)
    interval_s = float(fit.times_s[1] - fit.times_s[0])
    com, momentum = [], []
    for qpos, qvel in zip(fit.qpos, differentiate(model, fit.qpos, interval_s), strict=True):
        data.qpos[:], data.qvel[:] = qpos, qvel
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_subtreeVel(model, data)
        com.append(data.subtree_com[1].copy())
        momentum.append(data.subtree_angmom[1].copy())
    return np.array(com), np.array(momentum)


if __name__ == "__main__":
    main()
