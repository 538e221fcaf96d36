"""Two motions by formula for the gallery, which belong to nobody: sitting down, and getting up from a chair.

Legs move in their own plane: ankles stay, hips follow a path of least jerk, knees are where two links meet.
"""

from __future__ import annotations

import numpy as np

from simrecon import body as bodies
from simrecon import evidence as readers
from simrecon import kinematics
from simrecon.geometry import rotations
from simrecon.types import Array, Body, Evidence

HEIGHT_M, MASS_KG, FPS, SOLE_M = 1.75, 70.0, 30.0, 0.02
SEAT_M = 0.45
"""Height of the seat; hips are `HIPS_M` above it when they rest on it."""
HIPS_M, BEHIND_M = 0.10, 0.44
STOOP_RAD, REACH_RAD = 0.75, 0.9
"""How far the trunk bends forward, and the arms are lifted, half-way."""
BEFORE_S, MOVE_S, AFTER_S = 0.3, 1.3, 0.5
SEAT_AT_M, BENCH_M = (-0.46, 0.0), (0.44, 1.2, SEAT_M)
"""Middle of the seat, and the lengths of a bench there."""


def sitting_down() -> Evidence:
    """Somebody who stands, and sits down on a seat behind them."""
    return _evidence(_course())


def getting_up() -> Evidence:
    """The same backward."""
    return _evidence(_course()[::-1])


def _course() -> Array:
    """How far down, (T,), 0 to 1, with least jerk."""
    times = np.arange(0.0, BEFORE_S + MOVE_S + AFTER_S, 1 / FPS)
    s = np.clip((times - BEFORE_S) / MOVE_S, 0.0, 1.0)
    return np.asarray(s**3 * (10 - 15 * s + 6 * s * s))


def _evidence(down: Array) -> Evidence:
    skeleton = bodies.scaled({}, HEIGHT_M)
    body = bodies.build(skeleton, height_m=HEIGHT_M, mass_kg=MASS_KG, sole_m=SOLE_M)
    points = kinematics.configurations(body, poses(body, down))[1]
    return readers.from_arrays(
        np.arange(len(down)) / FPS,
        joint_names=skeleton.point_names,
        joints_m=points,
        joints_frame="world",
        height_m=HEIGHT_M,
        mass_kg=MASS_KG,
        trust="mocap",
    )


def poses(body: Body, down: Array) -> Array:
    """Configurations (T, nq) so far (T,) from standing to sitting; ankles over the origin."""
    thigh, shank, ankle_m = _lengths(body)
    stand, sit = thigh + shank - 0.004, SEAT_M + HIPS_M - ankle_m
    hip = np.stack((-BEHIND_M * down**0.8, stand + (sit - stand) * down), axis=-1)  # (T, 2) from the ankle
    lean = STOOP_RAD * np.sin(np.pi * down)
    reach = np.linalg.norm(hip, axis=-1).clip(max=stand)
    inner = np.arccos((thigh**2 + reach**2 - shank**2) / (2 * thigh * reach))
    thigh_rad = np.arctan2(hip[:, 0], hip[:, 1]) - inner  # about y, from hanging down
    knee = hip - thigh * np.stack((np.sin(thigh_rad), np.cos(thigh_rad)), axis=-1)
    shank_rad = np.arctan2(knee[:, 0], knee[:, 1])
    about_y = {"hip": thigh_rad - lean, "knee": shank_rad - thigh_rad, "ankle": -shank_rad}
    qpos = _configurations(body, about_y, REACH_RAD * np.sin(np.pi * down))
    qpos[:, 3:7] = rotations.exp(lean[:, None] * [0.0, 1.0, 0.0])
    ankle = kinematics.configurations(body, qpos)[1][:, body.skeleton.point_names.index("left_ankle")]
    qpos[:, 0] -= ankle[:, 0]
    qpos[:, 2] += ankle_m - ankle[:, 2]
    return qpos


def _lengths(body: Body) -> tuple[float, float, float]:
    """Of thigh and shank, and the height of the ankle over the floor, m."""
    standing = _configurations(body, {}, np.zeros(1))
    standing[:, 3] = 1.0
    places = kinematics.configurations(body, standing)[1][0]
    at = dict(zip(body.skeleton.point_names, places, strict=True))
    sole = min(at[f"left_{end}"][2] for end in ("heel", "toe")) - SOLE_M
    hip, knee, ankle = (at[f"left_{name}"] for name in ("hip", "knee", "ankle"))
    return float(hip[2] - knee[2]), float(knee[2] - ankle[2]), float(ankle[2] - sole)


def _configurations(body: Body, about_y: dict[str, Array], reach: Array) -> Array:
    """Configurations (T, nq) at the origin: legs turned about y, arms that hang and reach forward."""
    names = body.skeleton.names[1:]
    turns = np.zeros((len(reach), len(names), 3))
    for column, name in enumerate(names):
        turns[:, column, 1] = about_y.get(name.split("_")[-1], 0.0)
    joints = rotations.exp(turns)
    for side, sign in (("left", -1.0), ("right", 1.0)):
        lowered = rotations.exp(np.array([sign * 1.3, 0.0, 0.0]))
        lifted = rotations.exp(-reach[:, None] * [0.0, 1.0, 0.0])
        joints[:, names.index(f"{side}_shoulder")] = rotations.multiply(lifted, lowered)
    joints = rotations.multiply(rotations.conjugate(body.skeleton.rest[1:]), joints)
    return np.concatenate((np.zeros((len(reach), 7)), joints.reshape(len(reach), -1)), axis=1)
