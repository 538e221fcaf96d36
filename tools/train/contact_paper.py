"""Inputs, votes and rivals of the network of Rempe 2020, sections 3.2 and 4.1, as they are there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simrecon.contact.features import MIN_SCORE, POINTS
from simrecon.types import Array, Flags
from tools.train.contact_views import View

WINDOW, PREDICTED = 9, 5
HIDDEN = (1024, 512, 128, 32)
DROPOUT_BEFORE = 3
"""The layer of 128."""
BALL = 0.725
"""Of the way from heel to toe; it stands for OpenPose's small toe, which our data does not have."""
_UPPER = ("nose", "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist")


def _both(*names: str) -> tuple[str, ...]:
    return tuple(f"{side}_{name}" for name in names for side in ("left", "right"))


LOWER = ("pelvis", *_both("hip", "knee", "ankle", "heel", "toe", "ball"))
"""The 13 landmarks of the lower body."""
SETS = {
    "upper to hips": (*_UPPER, "pelvis", *_both("hip")),
    "upper to knees": (*_UPPER, "pelvis", *_both("hip", "knee")),
    "lower to ankles": _both("ankle", "heel", "toe", "ball"),
    "lower to hips": LOWER,
}


def landmarks(image: Array, scores: Array, names: Sequence[str]) -> Array:
    """Places and scores (T, J, 3) of landmarks; those that are not seen keep their last place."""
    found = np.concatenate((image, scores[..., None]), axis=-1)
    columns = []
    for name in names:
        side = name.split("_")[0]
        if name == "pelvis":
            columns.append(found[:, [POINTS.index("left_hip"), POINTS.index("right_hip")]].mean(axis=1))
        elif name.endswith("_ball"):
            heel, toe = (found[:, POINTS.index(f"{side}_{end}")] for end in ("heel", "toe"))
            columns.append((1 - BALL) * heel + BALL * toe)
        else:
            columns.append(found[:, POINTS.index(name)])
    return np.stack(columns, axis=1)


def windows(image: Array, scores: Array, names: Sequence[str], window: int = WINDOW) -> Array:
    """Inputs (T, window * J * 3): places from the pelvis of the middle frame, within about -1 and 1."""
    values = landmarks(image, scores, names)
    root = landmarks(image, scores, ("pelvis",))[:, 0, :2]
    tall = landmarks(image, scores, LOWER)[..., 1]
    size = float(np.median(np.ptp(tall, axis=1))) or 1.0
    half, frames = window // 2, np.arange(len(values))
    around = np.clip(frames[:, None] + np.arange(-half, half + 1), 0, len(values) - 1)  # (T, window)
    pieces = values[around]
    pieces = np.concatenate(((pieces[..., :2] - root[:, None, None]) / size, pieces[..., 2:]), axis=-1)
    return np.asarray(pieces.reshape(len(values), -1), np.float32)


def window_labels(touches: Flags, predicted: int = PREDICTED) -> Flags:
    """Labels (T, predicted * 4) of the frames around each frame."""
    half = predicted // 2
    around = np.clip(np.arange(len(touches))[:, None] + np.arange(-half, half + 1), 0, len(touches) - 1)
    return np.asarray(touches[around].reshape(len(touches), -1))


def votes(scores: Array, predicted: int = PREDICTED) -> Flags:
    """Labels (T, 4) by the majority of all windows that predict a frame, from logits (T, predicted * 4)."""
    half, frames = predicted // 2, len(scores)
    yes, count = np.zeros((frames, 4)), np.zeros((frames, 1))
    each = (scores > 0).reshape(frames, predicted, 4)
    for shift in range(-half, half + 1):
        rows = np.arange(max(0, -shift), min(frames, frames - shift))
        yes[rows + shift] += each[rows, shift + half]
        count[rows + shift] += 1
    return np.asarray(yes > count / 2)


def places(names: Sequence[str], window: int = WINDOW) -> Array:
    """Which inputs are places, not scores, (window * J * 3,)."""
    return np.tile([1.0, 1.0, 0.0], window * len(names))


FEET = ("left_heel", "right_heel", "left_toe", "right_toe")
"""In the order of the parts."""


def speeds(view: View, *, solid: bool) -> Array:
    """Speed of heels and toes (T, 4): in the image, leg lengths a second, or of the 3D estimate, m/s."""
    columns = [POINTS.index(name) for name in FEET]
    if solid:
        points = view.joints_m[:, columns]
        scale = 1.0
    else:
        points = np.where(view.scores[..., None] >= MIN_SCORE, view.image, np.nan)[:, columns]
        tall = landmarks(view.image, view.scores, LOWER)[..., 1]
        scale = float(np.median(np.ptp(tall, axis=1))) or 1.0
    step = np.linalg.norm(np.diff(points, axis=0), axis=-1) / (view.interval_s * scale)
    return np.concatenate((step[:1], step))


def best_threshold(speed: Array, touches: Flags) -> float:
    """The speed below which a foot touches that is right most often."""
    known = np.isfinite(speed)
    tried = np.quantile(speed[known], np.linspace(0.02, 0.98, 97))
    right = [float(((speed < limit) == touches)[known].mean()) for limit in tried]
    return float(tried[int(np.argmax(right))])
