"""The focal length of a camera that nobody knows, from the motion that it saw.

A wrong focal length puts the person at a wrong distance, where the pose that the image shows is not that of
the 3D estimate, and steps in depth are not those of the legs. So the clip is fitted with several focal
lengths f, and what remains of the evidence, D(f), is weighed against the usual lenses,

    J(f) = λ D(f) + (ln f - ln f₀)² / σ²

The terms of the fit are squares over their variances, added up in seconds, as if a second of frames were one
observation; λ halves that, for their errors last longer. J is taken for a parabola in ln f near its minimum,
whose curvature is the deviation that remains.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from simrecon.evidence.cutting import cut
from simrecon.geometry import camera as cameras
from simrecon.types import Array, Camera, Evidence, KinematicFit

TERMS = ("keypoint", "joint", "place")
"""Of the evidence itself: what is assumed of contact and balance drives lenses wide, wherever they are."""
SHARE = 0.5
"""λ."""
STEPS = (-2.0, -1.0, 0.0, 1.0, 2.0)
"""Focal lengths that are tried, in deviations of the usual one."""
RATE_HZ, FRAMES_MAX = 20.0, 100
"""Of the part of the clip that is fitted so often: its middle."""


def estimated(evidence: Evidence, fit: Callable[[Evidence], KinematicFit]) -> Evidence:
    """Evidence with the focal length that its motion makes most probable, if nobody knows it.

    Args:
        evidence: on a uniform time grid.
        fit: of evidence with a known lens.
    """
    camera = evidence.camera
    if camera is None or not camera.lens.focal_sigma or not evidence.keypoint_names:
        return evidence
    if not cameras.is_still(camera):  # its path is that of its lens
        return evidence
    part, sigma = middle(evidence), camera.lens.focal_sigma
    offsets = sigma * np.array(STEPS)
    left = [_left(fit(replace(part, camera=scaled(part.camera, np.exp(x), 0.0)))) for x in offsets]
    offset, deviation = most_probable(offsets, np.array(left), sigma)
    return replace(evidence, camera=scaled(camera, np.exp(offset), deviation))


def most_probable(offsets: Array, left: Array, sigma: float) -> tuple[float, float]:
    """Offset of ln f from the usual one at which J is least, and its deviation.

    Args:
        offsets: (N,) that were tried, increasing.
        left: (N,) D there.
        sigma: deviation of the usual one.
    """
    weights = np.exp(-0.5 * (offsets / sigma) ** 2)  # the parabola is of the middle
    bend, slope, _ = np.polyfit(offsets, left, 2, w=weights)
    curvature = 2 * max(SHARE * float(bend), 0.0) + 2 / sigma**2
    offset = -SHARE * (float(slope) if bend > 0 else _slope(offsets, left)) / curvature
    return float(np.clip(offset, offsets[0], offsets[-1])), float(np.sqrt(2 / curvature))


def _slope(offsets: Array, left: Array) -> float:
    return float(np.polyfit(offsets, left, 1)[0])


def scaled(camera: Camera | None, factor: float, sigma: float) -> Camera | None:
    """A camera with another focal length, known up to a deviation of its logarithm."""
    if camera is None:
        return None
    matrix = camera.lens.matrix_px.copy()
    matrix[[0, 1], [0, 1]] *= factor
    return replace(camera, lens=replace(camera.lens, matrix_px=matrix, focal_sigma=sigma))


def _left(fit: KinematicFit) -> float:
    """What the fit leaves of the evidence."""
    return float(sum(fit.loss.get(name, 0.0) for name in TERMS))


def middle(evidence: Evidence) -> Evidence:
    """The middle of the clip, at a rate that steps and swings can be seen at."""
    interval = float(evidence.times_s[1] - evidence.times_s[0])
    every = max(1, int(1 / (RATE_HZ * interval) + 1e-6))
    frames = min(len(evidence.times_s), FRAMES_MAX * every)
    first = (len(evidence.times_s) - frames) // 2
    camera = evidence.camera
    some = slice(first, first + frames, every)
    if len(range(frames)[::every]) < 2:
        some = slice(0, None, 1)
    return replace(cut(evidence, some), camera=None if camera is None else cameras.at(camera, some))
