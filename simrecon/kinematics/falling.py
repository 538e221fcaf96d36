"""How tall a person is who is seen to fall: everything falls by 9.81 m/s².

One camera takes a tall person far away for a short one nearby, who then seems to fall too slowly or too fast:
in a flight the centre of mass of a fit has the acceleration a, and true lengths are g / a times those of it.
Flights are where it moves along a parabola for long enough, that of a fall, with no push to the side.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from simrecon.kinematics import stature_prior
from simrecon.kinematics.terms.mass import GRAVITY_MPS2
from simrecon.types import Array, Evidence, KinematicFit, runs

LEAST_S, INNER_S = 0.35, 0.25
"""A flight lasts so long, and so long without the frames at its ends, in which feet still push."""
ENDS_S = 0.06
FALLS = (0.65, 1.5)
"""Acceleration of what may be a fall, over that of gravity."""
ASIDE_MAX = 0.2
"""To the side, in the same unit."""
OFF_M, ERROR_M = 0.012, 0.01
"""Distance from a parabola in a flight (root mean square, at most), and error of the centre of mass."""
SURE = 0.06
"""Deviation of the logarithm of the stature, up to which a flight says more than what adults are."""
STATURES_M = (1.4, 2.1)


def stature_m(evidence: Evidence, fit: KinematicFit) -> float | None:
    """The person's height by their flights and by what adults are; None where no flight says it.

    Args:
        evidence: of the fit.
        fit: without a size or a place of the camera that anybody knows.
    """
    camera = evidence.camera
    placed = camera is None or (camera.path is not None and evidence.ground_known)
    if evidence.height_m is not None or evidence.joints_frame == "world" or placed:
        return None
    found = np.array(list(flights(fit))).reshape(-1, 2)  # (F, 2)
    if not len(found):
        return None
    weights = found[:, 1] ** -2.0
    sigma = float(weights.sum() ** -0.5)
    if sigma > SURE:
        return None
    mean, spread = stature_prior.adults()
    fallen = np.log(fit.body.height_m) + float(weights @ found[:, 0]) / float(weights.sum())
    both = (fallen / sigma**2 + np.log(mean) / spread**2) / (sigma**-2 + spread**-2)
    return float(np.clip(np.exp(both), *STATURES_M))


def flights(fit: KinematicFit) -> Iterator[tuple[float, float]]:
    """Logarithm of true lengths over those of the fit, and its deviation, of each flight."""
    times = fit.times_s
    interval = float(times[1] - times[0])
    least = round(LEAST_S / interval) + 1
    falls = np.zeros(len(times), dtype=bool)
    for first in range(len(times) - least + 1):
        some = slice(first, first + least)
        falls[some] |= _falls(times[some], fit.com_m[some])
    ends = round(ENDS_S / interval)
    for rows in runs(falls):
        some = slice(rows.start + ends, rows.stop - ends)
        if times[some].size * interval < INNER_S or not _falls(times[some], fit.com_m[some]):
            continue
        down = -_parabola(times[some], fit.com_m[some])[0][2]
        # of a second derivative from N values with error e over T seconds: e √(720 / N) / T²
        count, lasts = len(times[some]), float(times[some][-1] - times[some][0])
        yield float(np.log(GRAVITY_MPS2 / down)), ERROR_M * np.sqrt(720 / count) / lasts**2 / down


def _falls(times_s: Array, com_m: Array) -> bool:
    """Whether a centre of mass (T, 3) falls freely."""
    acceleration, off = _parabola(times_s, com_m)
    share = -acceleration[2] / GRAVITY_MPS2
    aside = float(np.linalg.norm(acceleration[:2])) / GRAVITY_MPS2
    return FALLS[0] < share < FALLS[1] and aside < ASIDE_MAX * share and off < OFF_M


def _parabola(times_s: Array, com_m: Array) -> tuple[Array, float]:
    """Acceleration (3,) of the nearest parabola, and the distance of its height from it."""
    since = times_s - times_s.mean()
    terms = np.stack((np.ones_like(since), since, since**2 / 2), axis=1)  # (T, 3)
    solved = np.linalg.lstsq(terms, com_m, rcond=None)[0]  # (3, 3)
    off = com_m[:, 2] - terms @ solved[:, 2]
    return np.asarray(solved[2]), float(np.sqrt(np.mean(off**2)))
