"""Labels by a network learned from motion capture: the source `network` (`models/contact/network.npz`)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simrecon import resources
from simrecon.contact import features, stillness
from simrecon.contact.cues import Cues, rows_of
from simrecon.contact.parts import HEELS, TOES, names
from simrecon.geometry import camera as cameras
from simrecon.io.npz import load
from simrecon.types import Array, ContactLabels

Single = NDArray[np.float32]
SCHEMA = "simrecon.contact/1"
YES, NO, SUREST = 1.3, 0.3, 0.98
"""Weights of the rule of stillness where it says that a foot stands, and that it does not."""
BLOCK = 500
"""Frames that are looked at at once, which bounds memory."""


@dataclass(frozen=True, eq=False)
class Network:
    """A multilayer perceptron with rectified linear units, whose outputs are probabilities.

    Attributes:
        layers: weights (out, in) and biases (out,) of each.
        parts: P names of the outputs.
    """

    layers: tuple[tuple[Single, Single], ...]
    parts: tuple[str, ...]

    def __call__(self, inputs: Array) -> Array:
        """Probability of each part, (n, P), of inputs (n, features.COUNT)."""
        values = inputs.astype(np.float32)
        for weight, bias in self.layers[:-1]:
            values = np.maximum(values @ weight.T + bias, 0.0)
        weight, bias = self.layers[-1]
        return np.asarray(1 / (1 + np.exp(-np.clip(values @ weight.T + bias, -40, 40))), np.float64)


def read(path: Path) -> Network:
    """Read a network.

    Raises:
        InputError: it can't be read, or is none.
    """
    arrays = load(path)
    arrays.text("schema", (SCHEMA,))
    count = int(arrays.finite("layers", ()))
    layers = tuple(
        (arrays.finite(f"weight{i}", (f"n{i + 1}", f"n{i}")), arrays.finite(f"bias{i}", (f"n{i + 1}",)))
        for i in range(count)
    )
    plain = tuple((w.astype(np.float32), b.astype(np.float32)) for w, b in layers)
    return Network(plain, arrays.names("parts", "P"))


@cache
def shipped() -> Network:
    """The network that ships with simrecon."""
    return read(resources.folder("models") / "contact" / "network.npz")


def label(cues: Cues) -> ContactLabels:
    """Labels by landmarks and the 3D estimate around each frame; of feet with the rule of stillness.

    What is still nearly always stands, but what stands does not always look still: the log-odds of the rule
    are added to those of the network, more of a yes than of a no (docs/results/contacts.md).

    A camera that moves does not show what stands still: then the 3D estimate alone counts. Nor does an
    estimate that is not at its place in the world count.
    """
    net, rows = shipped(), rows_of(features.POINTS)
    still = cues.camera is not None and cameras.is_still(cues.camera)
    image = np.swapaxes(cues.rays[rows], 0, 1)  # (T, N, 2)
    scores = np.swapaxes(cues.scores[rows], 0, 1) if still else np.zeros(image.shape[:2])
    joints = np.swapaxes(cues.joints_m[rows], 0, 1)
    known = np.swapaxes(cues.known[rows], 0, 1) if cues.in_world else np.zeros(joints.shape[:2])
    found = np.empty((len(image), len(net.parts)))
    for start in range(0, len(image), BLOCK):
        frames = np.arange(start, min(start + BLOCK, len(image)))
        found[frames] = net(features.features(image, scores, joints, known, cues.interval_s, frames))
    probability = stillness.label(cues).probability.copy()
    own = [names().index(part) for part in net.parts]
    feet = [net.parts.index(part) for part in (*HEELS, *TOES)]
    rule = np.nan_to_num(_log_odds(probability[:, own][:, feet]))  # 0 where it says nothing
    weighed = _log_odds(found[:, feet]) + YES * np.maximum(rule, 0.0) + NO * np.minimum(rule, 0.0)
    found[:, feet] = 1 / (1 + np.exp(-weighed))
    probability[:, own] = found
    return ContactLabels(names(), probability, "network")


def _log_odds(probability: Array) -> Array:
    """Logarithm of p / (1 - p), as if nothing were surer than `SUREST`."""
    p = np.clip(probability, 1 - SUREST, SUREST)
    return np.asarray(np.log(p / (1 - p)))
