"""How tall the person is taken to be before anything is fitted, and how surely.

One camera can't tell a tall person far away from a short one nearby, and a network's sense of size is that of
the people it was trained on. So where nobody says the stature, what the source shows, ln s with deviation σ,
is weighed against what adults are, ln s₀ with σ₀:

    ln ŝ = (ln s / σ² + ln s₀ / σ₀²) / (1 / σ² + 1 / σ₀²),   σ̂² = 1 / (1 / σ² + 1 / σ₀²)

Motion capture is measured in metres, and adults have no say in it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from simrecon import body as bodies
from simrecon import resources
from simrecon.trust import Trust

GIVEN, MEASURED, ASSUMED = "given", "measured", "assumed"
GIVEN_SIGMA = 0.01
"""Of a stature that somebody says: people know theirs to a centimetre or two."""
UNSEEN = 1 / 3
"""On the deviation where the floor is unknown too: then nothing in the image has a size, and errors that
hundreds of frames share made a man of 1.80 m 1.03 m tall, 1.52 m with the whole deviation, 1.67 m so."""


@dataclass(frozen=True)
class Stature:
    """What the fit begins with.

    Attributes:
        height_m: most probable stature; None: what the measured lengths make it.
        sigma: deviation of its natural logarithm.
        origin: `given`, `measured` in a metric source, or `assumed` of an adult.
        shown_m: what the source's own lengths come to; None where it has none.
    """

    height_m: float | None
    sigma: float
    origin: str
    shown_m: float | None = None


def settle(height_m: float | None, lengths_m: Mapping[str, float], worth: Trust, *, floor: str) -> Stature:
    """Stature before the fit.

    Args:
        height_m: as somebody says it, or None.
        lengths_m: measured in the 3D estimate, by name; may be empty.
        worth: of the source.
        floor: how the floor is known, one of `trust.FLOORS`.
    """
    shown = bodies.stature_m(bodies.scaled(dict(lengths_m))) if lengths_m else None
    if worth.metric and shown is not None:
        return Stature(None, GIVEN_SIGMA if height_m else worth.size, MEASURED, shown)
    if height_m is not None:
        return Stature(height_m, GIVEN_SIGMA, GIVEN, shown)
    adult_m, spread = adults()
    ours, theirs = 0.0 if shown is None else 1 / worth.size**2, 1 / spread**2
    mean = (ours * math.log(shown or adult_m) + theirs * math.log(adult_m)) / (ours + theirs)
    sigma = (ours + theirs) ** -0.5
    return Stature(math.exp(mean), sigma * (UNSEEN if floor == "unknown" else 1.0), ASSUMED, shown)


def adults() -> tuple[float, float]:
    """Mean stature of adults, m, and the deviation of its natural logarithm (`models/body/mass.toml`)."""
    whole = resources.toml("models", "body", "mass.toml")["whole"]
    return float(whole["stature_m"]), float(whole["stature_spread_m"]) / float(whole["stature_m"])
