"""A small network of the synthesis with drawn weights, and a person who walks on the spot."""

from __future__ import annotations

from typing import Any

import numpy as np

from simrecon import kinematics
from simrecon.synthesis import Known
from simrecon.synthesis.features import COUNT, POINTS
from simrecon.synthesis.network import Dense, Gru, Network, Single
from simrecon.synthesis.network_file import PARTS
from simrecon.types import Array, Scene
from tests.support.runs import person, squat

STATE, CODE, MODES = 12, 4, 10
SIZES = {
    "context": (COUNT, STATE), "begin": (STATE, STATE), "decoder": (STATE + CODE + COUNT, STATE),
    "hidden": (STATE, STATE), "out": (STATE, COUNT), "choose": (COUNT, STATE), "chosen": (STATE, STATE),
    "factors": (STATE, MODES * CODE), "centres": (STATE, MODES * CODE),
}  # fmt: skip


def network(seed: int = 0, move: float = 0.01) -> Network:
    """Weights of half precision; `move` is the size of a step from a frame to the next."""
    rng = np.random.default_rng(seed)

    def drawn(*shape: int) -> Single:
        return _half(0.3 * rng.standard_normal(shape))

    parts: dict[str, Any] = {}
    for name, (inputs, outputs) in SIZES.items():
        if PARTS[name] is Gru:
            rows = 3 * outputs
            parts[name] = Gru(drawn(rows, inputs), drawn(rows, outputs), drawn(rows), drawn(rows))
        else:
            parts[name] = Dense(drawn(outputs, inputs), drawn(outputs))
    out = parts["out"]
    parts["out"] = Dense(*(_half(move * weights) for weights in (out.weight, out.bias)))
    return Network(np.zeros(COUNT, np.float32), np.ones(COUNT, np.float32), **parts)


def _half(values: Any) -> Single:
    return np.asarray(values, np.float16).astype(np.float32)


def known(frames: int = 31) -> Known:
    """A shallow squat at 30 Hz from 2 s on."""
    body = person()
    qpos = squat(body, 0.3 * np.sin(np.linspace(0.0, np.pi, frames)))
    return Known(body, Scene(), 2.0 + np.arange(frames) / 30, qpos)


def joints(one: Known) -> Array:
    """(T, K, 3) `features.POINTS` of a motion."""
    names = one.body.skeleton.point_names
    return kinematics.configurations(one.body, one.qpos)[1][:, [names.index(name) for name in POINTS]]
