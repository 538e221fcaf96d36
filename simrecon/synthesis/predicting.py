"""Futures of a person who moves: what the network predicts, as poses of the person's own body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon import kinematics
from simrecon import scene as scenes
from simrecon.errors import InputError
from simrecon.evidence import from_arrays
from simrecon.plan import Kinematics
from simrecon.synthesis import network_file
from simrecon.synthesis.features import CONTEXT, FUTURE, POINTS, RATE_HZ, features, places, stand
from simrecon.synthesis.network import Network
from simrecon.types import Array, Body, Scene

TRUST = "mocap,assume=0.3,joints_m=0.02,place_m=0.02,floor=scene"
"""Of predicted joints: their bones stretch, and their feet slide, by some centimetres."""
TOLERANCE_S = 1e-6


@dataclass(frozen=True, eq=False)
class Known:
    """A motion whose future is asked for.

    Attributes:
        body, scene: who moves where.
        times_s: (T,) increasing.
        qpos: (T, nq) the person's configurations.
    """

    body: Body
    scene: Scene
    times_s: Array
    qpos: Array


@dataclass(frozen=True, eq=False)
class Futures:
    """S futures of F frames, the first of which is the last that is known.

    Attributes:
        body, scene: who moves where.
        times_s: (F,) uniform, 30 Hz.
        joints_m: (S, F, K, 3) places of `features.POINTS` as the network predicts them.
        qpos: (S, F, nq) the poses of the person that come nearest to them, held to the floor.
    """

    body: Body
    scene: Scene
    times_s: Array
    joints_m: Array
    qpos: Array


def predict(
    known: Known, at_s: float, samples: int, seed: int, plan: Kinematics, network: Network | None = None
) -> Futures:
    """Predict what may follow a moment of a motion.

    Args:
        known: the motion.
        at_s: the moment; the 0.5 s before it are the context.
        samples: how many futures.
        seed: of the draws.
        plan: weights of the fit of the poses.
        network: another one than that which ships.

    Raises:
        InputError: the motion does not hold the context.
    """
    times_s, before = context(known, at_s)
    own = [known.body.skeleton.point_names.index(name) for name in POINTS]
    floor_m = float(scenes.support_height(known.scene, before[-1:, own[0], :2])[0])
    at = stand(before[-1, own], known.body.height_m, floor_m)
    seen = features(before[:, own], at)
    made = (network or network_file.shipped()).sample(seen, samples, np.random.default_rng(seed))
    joints = places(made, at)  # (S, FUTURE, K, 3)
    after = at_s + np.arange(1, FUTURE + 1) / RATE_HZ
    whole = np.concatenate((times_s, after))
    qpos = np.stack([_posed(known, whole, before, future, plan) for future in joints])
    first = np.repeat(before[None, -1:, own], samples, axis=0)
    return Futures(
        known.body,
        known.scene,
        whole[CONTEXT - 1 :],
        np.concatenate((first, joints), axis=1),
        qpos[:, CONTEXT - 1 :],
    )


def check_moment(times_s: Array, at_s: float) -> None:
    """Check that a motion at times (T,) holds a moment, and the context before it.

    Raises:
        InputError: it doesn't.
    """
    low, high = times_s[0] + (CONTEXT - 1) / RATE_HZ, times_s[-1]
    if not low - TOLERANCE_S <= at_s <= high + TOLERANCE_S:
        valid = f"{low:.2f} to {high:.2f} s" if low <= high else "a motion of half a second or more"
        raise InputError(f"--at: found {at_s:g} s; valid: {valid}, so that the motion before is known")


def context(known: Known, at_s: float) -> tuple[Array, Array]:
    """Times (CONTEXT,) and all points of the body (CONTEXT, M, 3) before a moment, at 30 Hz.

    Raises:
        InputError: the motion does not hold them.
    """
    check_moment(known.times_s, at_s)
    times_s = at_s + np.arange(1 - CONTEXT, 1) / RATE_HZ
    marks = kinematics.configurations(known.body, known.qpos)[1]  # (T, M, 3)
    columns = marks.reshape(len(marks), -1).T
    at = np.stack([np.interp(times_s, known.times_s, column) for column in columns], axis=1)
    return times_s, at.reshape(CONTEXT, *marks.shape[1:])


def _posed(known: Known, times_s: Array, before: Array, future: Array, plan: Kinematics) -> Array:
    """Poses (T, nq) of the context's points (CONTEXT, M, 3) and of a future's joints (FUTURE, K, 3)."""
    names = known.body.skeleton.point_names
    joints = np.full((len(times_s), len(names), 3), np.nan)
    joints[: len(before)] = before
    joints[len(before) :, [names.index(name) for name in POINTS]] = future
    seen = from_arrays(times_s, joint_names=names, joints_m=joints, trust=TRUST)
    return kinematics.pose(seen, known.body, known.scene, plan).qpos
