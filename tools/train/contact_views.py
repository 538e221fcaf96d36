"""What a virtual camera and a pose network see of a motion: videos for the training of contacts.

Camera of Rempe 2020, appendix A.1: 4.5 to 7.5 m away, at a height of N(0.9, 0.3) m within 0.3 and 1.75, up
to 90 degrees from the front, and looking at hip height. Landmarks have noise that lasts and noise that does
not, drop out, hide, and change sides, as those of pose networks do; a 3D estimate has errors of scale, lean,
drift and pose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from simrecon.body import names
from simrecon.contact.features import POINTS
from simrecon.contact.parts import names as part_names
from simrecon.geometry import rotations
from simrecon.types import Array, Flags
from tools.train.contact_motions import RATE_HZ, ContactMotion

FOCAL_PX, CENTRE_PX = 1400.0, np.array([640.0, 360.0])
SECONDS = 2.0
LASTING_PX, LASTING_S, WHITE_PX, DROPPED_PX = 3.0, 0.2, 2.5, 25.0
BIAS_M = 0.015
"""Networks put landmarks at places of their own."""
ROWS = names.resolve(POINTS)


def _mirrored(own: tuple[str, ...]) -> list[int]:
    """Where each name's other side stands."""
    swap = {"left": "right", "right": "left"}
    return [own.index("_".join([swap.get(n.split("_")[0], n.split("_")[0]), *n.split("_")[1:]])) for n in own]


_OTHER, _OTHER_PART = _mirrored(POINTS), _mirrored(part_names())


@dataclass(frozen=True, eq=False)
class View:
    """A video of T frames; N points of `features.POINTS`, P parts.

    Attributes:
        interval_s: between frames.
        image: (T, N, 2) px; scores: (T, N).
        joints_m: (T, N, 3) of the 3D estimate; NaN where there is none.
        touches: (T, P).
    """

    interval_s: float
    image: Array
    scores: Array
    joints_m: Array
    touches: Flags


def view(motion: ContactMotion, rate_hz: float, rng: np.random.Generator, solid: float = 0.5) -> View:
    """A random piece of a motion, on a person of a random size, seen by a random camera.

    Args:
        motion: at its own rate.
        rate_hz: of the video.
        rng: draws all of it.
        solid: share of the videos that have a 3D estimate.
    """
    length = (len(motion.points_m) - 1) / RATE_HZ
    start = rng.uniform(0, max(length - SECONDS, 0))
    times = np.arange(start, min(start + SECONDS, length) + 1e-9, 1 / rate_hz)
    size = rng.uniform(0.9, 1.12)
    points = size * _at(motion.points_m[:, ROWS], times)  # (T, N, 3)
    nearest = np.clip((times * RATE_HZ).round().astype(int), 0, len(motion.points_m) - 1)
    touches = motion.touches[nearest]
    if rng.random() < 0.5:  # in a mirror
        points, touches = points[:, _OTHER] * [1.0, -1.0, 1.0], touches[:, _OTHER_PART]
    seen = points + rng.normal(0, BIAS_M, points.shape[1:])
    image = _project(seen, points, rng)
    image, scores = _noisy(image, rate_hz, rng)
    estimate = _estimate(points, rate_hz, rng) if rng.random() < solid else np.full_like(points, np.nan)
    return View(1 / rate_hz, image, scores, estimate, touches)


def _at(values: Array, times: Array) -> Array:
    """Values (T, N, 3) at other times, linear."""
    at = np.clip(times * RATE_HZ, 0, len(values) - 1)
    low = np.minimum(at.astype(int), max(len(values) - 2, 0))
    part = (at - low)[:, None, None]
    return np.asarray((1 - part) * values[low] + part * values[np.minimum(low + 1, len(values) - 1)])


def viewpoint(
    points: Array, names: Sequence[str], rng: np.random.Generator, least_m: float = 0.0
) -> tuple[Array, Array]:
    """Where a camera stands before a person (Rempe 2020, appendix A.1).

    Args:
        points: (T, M, 3) of the person.
        names: of the points.
        rng: draws the place.
        least_m: distance.

    Returns:
        The centre (3,), and the axes (3, 3) right, down and ahead as rows.
    """
    middle = points.mean(axis=(0, 1))
    across = points[0, names.index("left_hip")] - points[0, names.index("right_hip")]
    yaw = np.arctan2(-across[0], across[1]) + rng.uniform(-np.pi / 2, np.pi / 2)
    away = max(rng.uniform(4.5, 7.5), least_m)
    height = np.clip(rng.normal(0.9, 0.3), 0.3, 1.75)
    eye = np.array([middle[0] + away * np.cos(yaw), middle[1] + away * np.sin(yaw), height])
    ahead = np.array([middle[0], middle[1], 0.9]) - eye
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return eye, np.stack((right, np.cross(ahead, right), ahead))


def _project(seen: Array, points: Array, rng: np.random.Generator) -> Array:
    """Pixels (T, N, 2) of places seen (T, N, 3) by a camera before a person at `points`."""
    eye, axes = viewpoint(points, POINTS, rng)
    xyz = (seen - eye) @ axes.T
    depth = np.maximum(xyz[..., 2:], 0.3)
    return np.asarray(xyz[..., :2] / depth * FOCAL_PX + CENTRE_PX)


def lasting(
    shape: tuple[int, ...], sigma: float, decay_s: float, rate_hz: float, rng: np.random.Generator
) -> Array:
    """Ornstein-Uhlenbeck noise over the first axis."""
    keep = np.exp(-1 / (rate_hz * decay_s))
    white = sigma * np.sqrt(1 - keep**2) * rng.standard_normal(shape)
    white[0] /= np.sqrt(1 - keep**2)
    return np.asarray(lfilter([1.0], [1.0, -keep], white, axis=0))


def _noisy(image: Array, rate_hz: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """Landmarks (T, N, 2) as a network finds them, and their scores (T, N)."""
    worse = rng.uniform(0.4, 1.6)
    found = image + worse * lasting(image.shape, LASTING_PX, LASTING_S, rate_hz, rng)
    found += worse * WHITE_PX * rng.standard_normal(image.shape)
    usual = rng.choice([0.99, 0.92, 0.8])
    scores = np.clip(usual + 0.06 * (1 - usual) / 0.08 * rng.standard_normal(image.shape[:2]), 0.05, 1.0)
    dropped = rng.random(scores.shape) < 0.03
    scores[dropped] = rng.uniform(0.02, 0.3, dropped.sum())
    found[dropped] += DROPPED_PX * rng.standard_normal((int(dropped.sum()), 2))
    frames = len(found)
    if rng.random() < 0.4 and frames > 10:  # legs change sides
        first = rng.integers(0, frames - 5)
        rows = slice(first, first + rng.integers(2, 6))
        for name in ("hip", "knee", "ankle", "heel", "toe"):
            pair = [POINTS.index(f"{side}_{name}") for side in ("left", "right")]
            found[rows, pair] = found[rows, pair[::-1]]
            scores[rows, pair] *= 0.6
    if rng.random() < 0.2:  # something is hidden
        hidden = rng.choice(len(POINTS), rng.integers(1, 5), replace=False)
        first = rng.integers(0, frames)
        rows = slice(first, first + int(rng.uniform(0.2, 1.0) * rate_hz))
        scores[rows, hidden] = 0.0
    return found, scores


def _estimate(points: Array, rate_hz: float, rng: np.random.Generator) -> Array:
    """A network's 3D estimate of places (T, N, 3)."""
    root = points[:, [POINTS.index("left_hip"), POINTS.index("right_hip")]].mean(axis=1)[:, None]
    lean = rotations.matrix(rotations.exp(np.append(np.deg2rad(rng.normal(0, 5, 2)), 0.0)))
    relative = (points - root) @ lean.T * (1 + rng.normal(0, 0.03))
    relative += lasting(points.shape, 0.03, 0.4, rate_hz, rng) + 0.006 * rng.standard_normal(points.shape)
    drift = lasting((len(points), 1, 3), 0.06, 0.8, rate_hz, rng)
    return np.asarray(root + drift + 0.005 * rng.standard_normal(drift.shape) + relative)
