"""Torque limits of weaker and stronger people (`models/body/strength.toml`)."""

from __future__ import annotations

import mujoco
import numpy as np

from simrecon import resources


def factors() -> dict[str, float]:
    """Factor on the torque limits by name; `usual` is 1."""
    table = resources.toml("models", "body", "strength.toml")
    return {name: float(entry["torque"]) for name, entry in table.items()}


def strengthened(mjcf: str, name: str) -> str:
    """A person's MJCF with the torque limits of all motors scaled; gains stay.

    Args:
        mjcf: the person.
        name: of `factors`.
    """
    factor = factors()[name]
    if factor == 1.0:
        return mjcf
    spec = mujoco.MjSpec.from_string(mjcf)
    for motor in spec.actuators:
        motor.forcerange = factor * np.array(motor.forcerange)
    text: str = spec.to_xml()
    return text
