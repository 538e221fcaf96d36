"""Stiffness and damping of a compliant floor from a clip: the values on which its simulation costs least.

Golden-section search over the logarithm of the stiffness at a usual damping, then over the damping ratio at
the stiffness found. Every trial is a reconstruction of its own, with the same seed; all but the first start
from the best motion so far.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from simrecon.errors import InputError, SimreconError
from simrecon.observer import SILENT, Observer
from simrecon.pipeline import Reconstruction
from simrecon.replay import SIMULATED
from simrecon.types import Ground, Motion, Scene

STIFFNESS_NPM = (3e3, 3e5)
"""Range of the search: from a soft crash mat to a floor that nobody feels."""
DAMPING_RATIO = (0.05, 1.0)
USUAL_RATIO, USUAL_MASS_KG = 0.3, 70.0
STIFFNESS_TRIALS, DAMPING_TRIALS = 9, 5
_GOLDEN = (math.sqrt(5) - 1) / 2

Loss = Callable[[float, float], float]
"""Of a stiffness, N/m, and a damping ratio."""


@dataclass(frozen=True)
class Trial:
    """One floor that was tried: what it was, and the loss on it, a geometric mean over windows.

    A window that falls costs a thousand times more than one that does not: it would drown all others.
    """

    stiffness_Npm: float
    damping_Nspm: float
    loss: float


@dataclass(frozen=True)
class Calibration:
    """The floor on which the clip costs least.

    Attributes:
        ground: with the best stiffness and damping.
        trials: all that were tried, in order: the loss curve.
        motion: the best, to start from.
        at_bound: the stiffness found lies at an end of the range, so the clip only bounds it.
    """

    ground: Ground
    trials: tuple[Trial, ...]
    motion: Motion
    at_bound: bool


Simulate = Callable[[Scene, Motion | None], Reconstruction]
"""Reconstructs the clip in a scene, from a finished motion on if there is one."""


def calibrate(
    simulate: Simulate, scene: Scene, mass_kg: float | None, observer: Observer = SILENT
) -> Calibration:
    """Find stiffness and damping of the ground of a clip.

    Args:
        simulate: reconstructs the clip; every trial with the same seed.
        scene: whose ground is to be calibrated.
        mass_kg: of the person, if it is known.
        observer: is told of the progress, in trials.

    Raises:
        InputError: the ground is not to be calibrated, or the evidence can't be used.
        SimreconError: no trial could be simulated.
    """
    if not scene.ground.calibrate:
        raise InputError('[ground] stiffness_Npm is a number; valid: "fit", to find it from the clip')
    trials: list[Trial] = []
    best: list[Motion] = []
    lowest = math.inf
    total = float(STIFFNESS_TRIALS + DAMPING_TRIALS)

    def loss(stiffness: float, ratio: float) -> float:
        nonlocal lowest
        observer.stage("soft floor", float(len(trials)), total)
        ground = _ground(scene.ground, stiffness, ratio, mass_kg or USUAL_MASS_KG)
        run = simulate(replace(scene, ground=ground), best[-1] if best else None)
        mean = _mean_loss(run)
        trials.append(Trial(stiffness, float(ground.damping_Nspm or 0.0), mean))
        if mean < lowest:
            lowest = mean
            best.append(run.motion)
        return mean

    search(loss)
    observer.stage("soft floor", total, total)
    if not best:
        raise SimreconError("soft floor: no floor between 3 and 300 kN/m could be simulated to the end")
    return _calibration(scene.ground, tuple(trials), best[-1])


def _mean_loss(run: Reconstruction) -> float:
    """Geometric mean over the windows; infinite if the clip was not simulated to its end."""
    if (run.motion.status != SIMULATED).any():
        return math.inf
    logs = [math.log(window.loss) for window in run.windows]
    return math.exp(sum(logs) / len(logs))


def _calibration(ground: Ground, trials: tuple[Trial, ...], motion: Motion) -> Calibration:
    """The best trial, and whether it lies at an end of the range."""
    best = min(trials, key=lambda trial: trial.loss)
    span = math.log(STIFFNESS_NPM[1] / STIFFNESS_NPM[0])
    edge = min(abs(math.log(best.stiffness_Npm / end)) for end in STIFFNESS_NPM) / span
    stiff = replace(ground, calibrate=False, stiffness_Npm=best.stiffness_Npm, damping_Nspm=best.damping_Nspm)
    return Calibration(stiff, trials, motion, edge < 0.03)


def search(loss: Loss) -> tuple[float, float]:
    """Stiffness, N/m, at the usual damping, then the damping ratio at it, of the least loss seen."""
    low, high = (math.log(value) for value in STIFFNESS_NPM)
    stiffness = math.exp(golden(lambda x: loss(math.exp(x), USUAL_RATIO), low, high, STIFFNESS_TRIALS))
    low, high = (math.log(value) for value in DAMPING_RATIO)
    ratio = math.exp(golden(lambda x: loss(stiffness, math.exp(x)), low, high, DAMPING_TRIALS))
    return stiffness, ratio


def golden(function: Callable[[float], float], low: float, high: float, evaluations: int) -> float:
    """Argument of the least value seen by a golden-section search (Kiefer 1953) in [low, high].

    Args:
        function: with one minimum there, to be found.
        low: lower end of the interval.
        high: upper end of it.
        evaluations: at least 2.
    """
    left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    seen = {left: function(left), right: function(right)}
    for _ in range(evaluations - 2):
        if seen[left] <= seen[right]:
            high, right = right, left
            left = high - _GOLDEN * (high - low)
            seen[left] = function(left)
        else:
            low, left = left, right
            right = low + _GOLDEN * (high - low)
            seen[right] = function(right)
    return min(seen, key=lambda x: seen[x])


def _ground(ground: Ground, stiffness: float, ratio: float, mass_kg: float) -> Ground:
    damping = ratio * 2 * math.sqrt(stiffness * mass_kg)
    return replace(ground, calibrate=False, stiffness_Npm=stiffness, damping_Nspm=damping)
