"""Attributes of geoms that say how the scene's contacts behave."""

from __future__ import annotations

from typing import Any

from simrecon.types import Friction

# Torsional and rolling friction, metres; MuJoCo's defaults (documentation, XML reference, geom/friction).
_SPIN_FRICTION_M, _ROLL_FRICTION_M = 0.005, 0.0001
_HARD_SOLIMP = (0.9999, 0.99999, 0.001, 0.5, 2.0)


def rubbing(friction: Friction) -> dict[str, Any]:
    """Attributes of a geom of the scene that touches person and items with its own friction."""
    spin, roll = friction.torsional_m, friction.rolling_m
    dims = 3 if spin is None else 4 if roll is None else 6
    values = [
        friction.sliding,
        _SPIN_FRICTION_M if spin is None else spin,
        _ROLL_FRICTION_M if roll is None else roll,
    ]
    return {"contype": 1, "conaffinity": 1, "condim": dims, "priority": 1, "friction": values}


def hard(timestep_s: float) -> dict[str, Any]:
    """Attributes of a sprung surface, whose contacts are all but hard: the spring gives way instead.

    They settle as fast as they can without ringing or adding inertia. Measured with a block of 70 kg on 20
    and 50 kN/m: at a time constant of one step its weight sank it 7 to 80 per cent too far, at five it
    rebounded 20 per cent too high.
    """
    return {"solimp": _HARD_SOLIMP, "solref": [1.5 * timestep_s, 1.0]}
