"""What the scene does to some bodies of a model, step by step of rollouts: a sensor for each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from simrecon.types import Array, IntArray

_FIELDS = (
    mujoco.mjtConDataField.mjCONDATA_FORCE,
    mujoco.mjtConDataField.mjCONDATA_TORQUE,
    mujoco.mjtConDataField.mjCONDATA_POS,
)
_NET_FORCE, _ONE = 3, 1
"""How a sensor sums contacts up: one force, with its centre of pressure."""


@dataclass(frozen=True, eq=False)
class Felt:
    """Bodies whose contacts are measured.

    Attributes:
        model: moves as the one without sensors does, to the last bit. bodies: K ids.
    """

    model: mujoco.MjModel
    bodies: tuple[int, ...]

    @classmethod
    def of(cls, mjcf: str, names: Sequence[str]) -> Felt:
        """The bodies of such names in a model's text."""
        model = _sensed(mjcf, mujoco.mjtObj.mjOBJ_BODY, names)
        return cls(model, tuple(model.body(name).id for name in names))

    @classmethod
    def of_geoms(cls, mjcf: str, names: Sequence[str]) -> Felt:
        """The geoms of such names; `bodies` are their ids, of which no slopes can be asked."""
        model = _sensed(mjcf, mujoco.mjtObj.mjOBJ_GEOM, names)
        return cls(model, tuple(model.geom(name).id for name in names))

    def wrenches(self, sensed: Array) -> Array:
        """Moment about the world's origin and force on each body (..., K, 6), of sensor data (..., 9 K)."""
        rows = sensed.reshape(*sensed.shape[:-1], len(self.bodies), 3, 3)
        force, moment, place = -rows[..., 0, :], -rows[..., 1, :], rows[..., 2, :]  # on what it touches
        return np.concatenate((moment + np.cross(place, force), force), axis=-1)


def _sensed(mjcf: str, kind: mujoco.mjtObj, names: Sequence[str]) -> mujoco.MjModel:
    """The model of a text, with a sensor of contacts for each of some bodies, or geoms."""
    spec = mujoco.MjSpec.from_string(mjcf)
    fields = sum(1 << int(field) for field in _FIELDS)
    for name in names:
        spec.add_sensor(
            name=f"felt_{name}",
            type=mujoco.mjtSensor.mjSENS_CONTACT,
            objtype=kind,
            objname=name,
            intprm=np.array([fields, _NET_FORCE, _ONE]),
        )
    return spec.compile()


def means(wrenches: Array, at_steps: IntArray) -> Array:
    """Means (P, F, K, 6) of wrenches (P, N, K, 6) since the step before; zero at the first."""
    sums = np.zeros((len(wrenches), wrenches.shape[1] + 1, *wrenches.shape[2:]))
    np.cumsum(wrenches, axis=1, out=sums[:, 1:])
    found = np.zeros((len(wrenches), len(at_steps), *wrenches.shape[2:]))
    lengths = np.diff(at_steps)[:, None, None]
    found[:, 1:] = np.diff(sums[:, at_steps], axis=1) / lengths
    return found
