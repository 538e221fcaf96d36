"""How a camera that nobody placed is tilted, from the motion that it saw.

People keep their size, and the floor is level: before a camera that is taken for tilted by the wrong angle,
who goes farther away rises or sinks, so that feet leave the floor, or the image. So the clip is fitted with
several tilts x, pitch about the image's x axis and roll about the view, away from the up that balance gives
(`upright`), and what remains, D(x), is weighed against it:

    J(x) = λ D(x) + |x|² / σ²

Along each axis J is taken for a parabola. Its minimum is the middle of a second, narrower round.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from simrecon.geometry import rotations
from simrecon.types import Array, KinematicFit

Fit = Callable[[Array], KinematicFit]
TERMS = ("keypoint", "joint", "place", "still", "contact", "penetration")
"""Evidence and floor; what is assumed of balance has had its say."""
SHARE, SIGMA_RAD = 2.0, np.radians(3.0)
"""λ and σ, by which most clips with a known camera came nearer to its tilt (docs/studies/video.md)."""
STEPS_RAD = (np.radians(3.0), np.radians(2.0))
"""Of each round, to either side."""
FARTHEST = 1.5
"""Steps that a round goes at most."""


def estimated(fit: Fit) -> Array:
    """The tilt (2,), rad, that the motion makes most probable.

    Args:
        fit: of a part of the clip, with a tilt.
    """

    def left(tilt: Array) -> float:
        loss = fit(tilt).loss
        remains = sum(loss.get(name, 0.0) for name in TERMS)
        return float(SHARE * remains + tilt @ tilt / SIGMA_RAD**2)

    middle = np.zeros(2)
    for step in STEPS_RAD:
        here = left(middle)
        sides = [[left(middle + sign * step * axis) for sign in (-1, 1)] for axis in np.eye(2)]
        middle = middle + step * np.array([lowest(below, here, above) for below, above in sides])
    return middle


def lowest(below: float, here: float, above: float) -> float:
    """Where a parabola through values at -1, 0 and 1 is least, at most `FARTHEST` away."""
    bend = below - 2 * here + above
    if bend <= 0:
        return float(np.sign(below - above)) * FARTHEST
    return float(np.clip(0.5 * (below - above) / bend, -FARTHEST, FARTHEST))


def turned(tilt: Array, extrinsics: Array) -> Array:
    """The rotation (3, 3) in the world of a camera with a tilt (2,) and extrinsics (4, 4)."""
    axis = extrinsics[:3, :3].T @ np.array([tilt[0], 0.0, tilt[1]])
    return rotations.matrix(rotations.exp(axis))
