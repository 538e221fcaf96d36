"""Motions by formula on the floor and on a bench: hands, knees, seat and back rarely touch in recordings.

A motion goes through postures, each with parts that touch: angles of the joints are found so that these parts
reach what bears them, and the centre of mass is over them. From one posture to the next angles change with
least jerk, the lowest point stays on the floor, and what touches in both stays where it is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from scipy.optimize import least_squares

from simrecon import body as bodies
from simrecon import evidence as readers
from simrecon import kinematics
from simrecon.contact.parts import names as part_names
from simrecon.contact.parts import parts
from simrecon.geometry import rotations
from simrecon.kinematics.touched import touched
from simrecon.types import Array, Body, Evidence, Scene, SceneItem

RATE_HZ, MOVE_S, HOLD_S = 30.0, (0.7, 1.3), (0.15, 0.5)
HEIGHT_M, KG_PER_M3 = (1.5, 1.9), 13.5
BENCH_M, BENCH_SIZE_M, BEFORE_HIPS_M = (0.38, 0.5), (0.44, 1.2), 0.2
"""Height of a bench; its depth and width; how far its edge is in front of the hips of who sits."""
VARIED_RAD, SLACK_M = 0.12, 0.03
"""How much angles vary, and how far inside of what bears it the centre of mass is."""
NEAR_PER_M, BALANCE_PER_M, ABOUT_PER_RAD, STEP = 50.0, 20.0, 0.7, 1e-5
COUNTS = {"test": 12, "train": 60, "validation": 15}
"""Motions of each part of the split; every third is on a bench, others begin with each posture in turn."""
ANGLES = (
    *("pitch", "bend", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle"),
    *("abduction", "left_reach", "right_reach", "elbow", "wrist"),
)
"""rad: the pelvis forward, the trunk forward, limbs forward, knees and elbows bent, toes down, arms away."""
LOW, HIGH = (
    np.radians([-95, -30, -130, -130, 2, 2, -32, -32, 3, -60, -60, 2, 0]),
    np.radians([100, 70, 25, 25, 145, 145, 50, 50, 60, 150, 150, 120, 70]),
)


def _both(*ends: str) -> tuple[str, ...]:
    return tuple(f"{side}_{end}" for end in ends for side in ("left", "right"))


@dataclass(frozen=True)
class Posture:
    """About which angles, in degrees, and which parts touch; angles of both sides where no side is named."""

    about: Mapping[str, float]
    touch: tuple[str, ...]


POSTURES = {
    "stand": Posture({"knee": 5, "hip": -3, "ankle": -2, "abduction": 10}, _both("heel", "toe")),
    "stoop": Posture(
        {"pitch": 35, "bend": 15, "hip": -75, "knee": 70, "ankle": -30, "reach": 40}, _both("heel", "toe")
    ),
    "crouch": Posture(
        {"pitch": 50, "bend": 40, "hip": -115, "knee": 110, "ankle": -25, "reach": 100},
        _both("toe", "hand"),
    ),
    "kneel": Posture({"pitch": 5, "hip": -5, "knee": 92, "ankle": 0, "abduction": 10}, _both("knee", "toe")),
    "kneel on one": Posture(
        {"pitch": 5, "left_hip": -95, "left_knee": 90, "right_hip": -5, "right_knee": 95, "right_ankle": -20},
        ("left_heel", "left_toe", "right_knee", "right_toe"),
    ),
    "on all fours": Posture(
        {"pitch": 75, "bend": 5, "hip": -80, "knee": 95, "ankle": 20, "reach": 85, "wrist": 60},
        _both("hand", "knee", "toe"),
    ),
    "press-up": Posture(
        {"pitch": 70, "hip": 0, "knee": 5, "ankle": -25, "reach": 80, "wrist": 60}, _both("hand", "toe")
    ),
    "prone": Posture(
        {"pitch": 88, "hip": 5, "knee": 8, "ankle": 40, "reach": 30, "elbow": 80, "abduction": 50},
        ("back", *_both("toe", "knee", "hand")),
    ),
    "sit": Posture(
        {"pitch": -15, "bend": 30, "hip": -80, "knee": 60, "ankle": 0, "reach": 40},
        _both("buttock", "heel"),
    ),
    "sit on hands": Posture(
        {"pitch": -35, "bend": 10, "hip": -60, "knee": 60, "reach": -50, "wrist": 50},
        _both("buttock", "heel", "hand"),
    ),
    "supine": Posture(
        {"pitch": -90, "bend": 0, "hip": -10, "knee": 20, "reach": 0, "abduction": 25},
        ("back", *_both("buttock", "heel", "hand")),
    ),
}
SEATED = Posture(
    {"pitch": 0, "bend": 10, "hip": -88, "knee": 88, "ankle": 0, "reach": 30}, _both("buttock", "heel", "toe")
)
NEXT = {
    "stand": ("crouch", "kneel on one", "stoop"),
    "stoop": ("sit", "crouch"),
    "crouch": ("on all fours", "press-up"),
    "kneel": ("on all fours", "kneel on one"),
    "kneel on one": ("kneel", "stand"),
    "on all fours": ("kneel", "press-up", "prone"),
    "press-up": ("prone", "crouch", "on all fours"),
    "prone": ("press-up", "on all fours"),
    "sit": ("sit on hands", "supine"),
    "sit on hands": ("supine", "sit"),
    "supine": ("sit on hands", "sit"),
}


def motions() -> Iterator[tuple[str, Callable[[], tuple[Evidence, Scene]]]]:
    """By name, `grounded_PART_NUMBER`, what gives joints and scene; each is drawn from its own seed."""
    for part, count in COUNTS.items():
        for number in range(count):
            rng = np.random.default_rng([len(part), number])
            floor = partial(_on_floor, rng, list(POSTURES)[number % len(POSTURES)])
            yield f"grounded_{part}_{number:02d}", partial(_on_bench, rng) if number % 3 == 2 else floor


def _on_floor(rng: np.random.Generator, key: str) -> tuple[Evidence, Scene]:
    body, keys = _person(rng), [key]
    for _ in range(3):
        keys.append(str(rng.choice(NEXT[keys[-1]])))
    found = [(POSTURES[key], _solved(body, POSTURES[key], 0.0, rng)) for key in keys]
    return _evidence(body, _course(body, found, rng)), Scene()


def _on_bench(rng: np.random.Generator) -> tuple[Evidence, Scene]:
    body, high = _person(rng), float(rng.uniform(*BENCH_M))
    stand, stoop = POSTURES["stand"], POSTURES["stoop"]
    chain = [(stand, 0.0), (stoop, 0.0), (SEATED, high), (SEATED, high), (stoop, 0.0), (stand, 0.0)]
    first = int(rng.integers(0, 3))
    found = [(posture, _solved(body, posture, seat, rng)) for posture, seat in chain[first : first + 4]]
    qpos = _course(body, found, rng)
    points = kinematics.configurations(body, qpos)[1]
    hips = points[:, [body.skeleton.point_names.index(name) for name in _both("hip")]].mean(axis=1)
    back = float(np.quantile(hips[:, 0], 0.1))  # where they are when they sit
    depth, width = BENCH_SIZE_M
    place = (back + BEFORE_HIPS_M - depth / 2, 0.0, 0.0)
    item = SceneItem("bench", "box", place, {"size_m": (depth, width, high)})
    return _evidence(body, qpos), Scene(items=(item,))


def _person(rng: np.random.Generator) -> Body:
    height = float(rng.uniform(*HEIGHT_M))
    mass = KG_PER_M3 * height**3 * float(rng.uniform(0.85, 1.2))
    return bodies.build(bodies.scaled({}, height), height_m=height, mass_kg=mass)


def _evidence(body: Body, qpos: Array) -> Evidence:
    return readers.from_arrays(
        np.arange(len(qpos)) / RATE_HZ,
        joint_names=body.skeleton.point_names,
        joints_m=kinematics.configurations(body, qpos)[1],
        joints_frame="world",
        height_m=body.height_m,
        mass_kg=body.mass_kg,
        trust="mocap",
    )


def _start(posture: Posture, rng: np.random.Generator) -> Array:
    """Angles (13,) to begin with: those of the posture, a little different."""
    values = [
        posture.about.get(name, posture.about.get(name.removeprefix("left_").removeprefix("right_"), 0.0))
        for name in ANGLES
    ]
    varied = np.radians(values) + VARIED_RAD * rng.standard_normal(len(ANGLES))
    return np.clip(varied, LOW + 0.01, HIGH - 0.01)


def _solved(body: Body, posture: Posture, seat_m: float, rng: np.random.Generator) -> Array:
    """Angles (13,) at which the parts of a posture touch, the seat at its height, and nothing tips over."""
    start = _start(posture, rng)
    own = [part_names().index(part) for part in posture.touch]
    height = np.array([seat_m if part.endswith("buttock") else 0.0 for part in posture.touch])

    def residuals(x: Array) -> Array:
        """Of unknowns (n, 14): angles, and how high the pelvis is."""
        qpos = _configurations(body, x[:, :-1])
        qpos[:, 2] = x[:, -1]
        clearance = touched(body, Scene(), qpos, np.arange(float(len(qpos)))).clearance_m
        com, points = kinematics.configurations(body, qpos)
        at = _anchor(body, points, posture.touch)
        off = np.maximum(com[:, 0] - at.max(axis=1), at.min(axis=1) - com[:, 0])
        terms = (
            NEAR_PER_M * (clearance[:, own] - height),
            NEAR_PER_M * np.minimum(clearance, 0.0),
            BALANCE_PER_M * np.maximum(off + SLACK_M, 0.0)[:, None],
            ABOUT_PER_RAD * (x[:, :-1] - start),
        )
        return np.concatenate(terms, axis=1)

    def slopes(x: Array) -> Array:
        moved = residuals(np.concatenate((x[None], x + STEP * np.eye(len(x)))))
        return np.asarray((moved[1:] - moved[0]).T / STEP)

    tall = np.append(start, 0.5 * body.height_m)
    bounds = (np.append(LOW, 0.0), np.append(HIGH, body.height_m))
    found = least_squares(lambda x: residuals(x[None])[0], tall, slopes, bounds=bounds, max_nfev=25)
    return np.asarray(found.x[:-1])


def _course(body: Body, found: list[tuple[Posture, Array]], rng: np.random.Generator) -> Array:
    """Configurations (T, nq) through postures, with what touches in two of them where it was."""
    pieces, ahead = [], 0.0
    for (before, start), (after, end) in pairwise(found):
        move, hold = rng.uniform(*MOVE_S), rng.uniform(*HOLD_S)
        s = np.clip(np.arange(0.0, move + hold, 1 / RATE_HZ) / move, 0.0, 1.0)
        s = s**3 * (10 - 15 * s + 6 * s * s)
        qpos = _configurations(body, start + s[:, None] * (end - start))
        times = np.arange(len(qpos)) / RATE_HZ
        qpos[:, 2] -= touched(body, Scene(), qpos, times).clearance_m.min(axis=1)
        common = tuple(part for part in before.touch if part in after.touch) or before.touch
        at = _anchor(body, kinematics.configurations(body, qpos)[1], common).mean(axis=1)
        qpos[:, 0] += ahead + at[0] - at
        ahead = float(qpos[-1, 0])
        pieces.append(qpos)
    return np.concatenate(pieces)


def _anchor(body: Body, points_m: Array, touch: tuple[str, ...]) -> Array:
    """Places along x (T, n) of the points of parts that touch, from points (T, M, 3)."""
    held = [point for part in parts() if part.name in touch for point in part.held]
    return points_m[:, [body.skeleton.point_names.index(name) for name in held], 0]


def _configurations(body: Body, angles: Array) -> Array:
    """Configurations (T, nq) at the origin, of angles (T, 13)."""
    at, names = dict(zip(ANGLES, angles.T, strict=True)), body.skeleton.names[1:]
    zero = np.zeros(len(angles))
    joints = np.zeros((len(angles), len(names), 4))
    joints[..., 0] = 1.0

    def turn(name: str, x: Array = zero, y: Array = zero, z: Array = zero) -> None:
        joints[:, names.index(name)] = rotations.exp(np.stack((x, y, z), axis=-1))

    turn("spine", y=0.5 * at["bend"])
    turn("chest", y=0.5 * at["bend"])
    turn("neck", y=-0.4 * at["bend"])
    for side, sign in (("left", 1.0), ("right", -1.0)):
        turn(f"{side}_hip", x=np.full_like(zero, sign * 0.08), y=at[f"{side}_hip"])
        turn(f"{side}_knee", y=at[f"{side}_knee"])
        turn(f"{side}_ankle", y=at[f"{side}_ankle"])
        turn(f"{side}_elbow", z=-sign * at["elbow"])
        turn(f"{side}_wrist", x=sign * at["wrist"])
        lowered = rotations.exp(np.stack((-sign * (np.pi / 2 - at["abduction"]), zero, zero), axis=-1))
        lifted = rotations.exp(np.stack((zero, -at[f"{side}_reach"], zero), axis=-1))
        joints[:, names.index(f"{side}_shoulder")] = rotations.multiply(lifted, lowered)
    joints = rotations.multiply(rotations.conjugate(body.skeleton.rest[1:]), joints)
    root = rotations.exp(np.stack((zero, at["pitch"], zero), axis=-1))
    return np.concatenate((np.zeros((len(angles), 3)), root, joints.reshape(len(angles), -1)), axis=1)
