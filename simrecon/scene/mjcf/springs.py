"""Spring and damper of a sprung surface as MuJoCo's `discrete` integrator needs them."""

from __future__ import annotations

import math

GRAVITY_COMPENSATED = 1.0
"""Sprung surfaces carry no weight of their own: their rest height is that of the scene file."""


def joint_damping_Nspm(
    stiffness_Npm: float, damping_Nspm: float, mass_kg: float, timestep_s: float, load_kg: float = math.inf
) -> float:
    """Joint damping with which a simulated spring is damped as in continuous time.

    The `discrete` integrator takes spring and damper at the end of the step,
    (m + h c' + h² k) v' = m v - h k q, which damps like h k more. A swing of load M and surface m decays per
    step by sqrt((M + m) / (M + m + h c' + h² k)); equating that with exp(-c h / 2 M), the decay in continuous
    time, gives c', which may be negative. The surface alone is stable for 4 m + 2 h (c' + h k) > h² k; where
    c is below that, the damping is the least that is stable.

    Args:
        stiffness_Npm: k of the spring.
        damping_Nspm: c in continuous time.
        mass_kg: m of the surface.
        timestep_s: h.
        load_kg: M, of the person.

    Returns:
        c' in N·s/m.
    """
    least = max(0.0, (1.05 * timestep_s**2 * stiffness_Npm - 4 * mass_kg) / (2 * timestep_s))
    exact = damping_Nspm
    if math.isfinite(load_kg):
        growth = min(damping_Nspm * timestep_s / load_kg, 1.0)
        exact *= (1 + mass_kg / load_kg) * math.expm1(growth) / growth if growth > 0 else 1.0
    return max(exact, least) - timestep_s * stiffness_Npm
