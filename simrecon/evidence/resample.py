"""Evidence on a uniform time grid, and the frames in which the person is in view."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simrecon.errors import InputError
from simrecon.evidence import sides
from simrecon.geometry import camera as cameras
from simrecon.types import Array, Evidence, IntArray

# All in frame intervals.
JITTER_MAX = 1e-3  # frames this near to the grid are taken as they are
CLOCK_ERROR_MAX = 0.25  # frames this near to a grid of constant rate with dropped frames belong to it
FRAMES_MAX = 200_000  # at some 50 kB each in the kinematic fit
GAPS_MAX, GAPS_SHARE = 10_000, 20  # of which so many may be missing, and so many for each that is there
TAKE_OVER_MAX = 0.1  # beside an unseen frame, a grid point takes over a frame that is this near
GAP_MIN = 1.5  # from here on, a frame is missing between two frames


@dataclass(frozen=True, eq=False)
class _Neighbours:
    """The frames before and after each of G grid points.

    Attributes:
        before, after: (G,) indices of the frames.
        fraction: (G,) 0 at the frame before, 1 at the one after.
        adjacent: (G,) no frame is missing between the two.
        near_before, near_after: (G,) the frame may be taken over as it is.
    """

    before: IntArray
    after: IntArray
    fraction: Array
    adjacent: NDArray[np.bool_]
    near_before: NDArray[np.bool_]
    near_after: NDArray[np.bool_]


def resample(evidence: Evidence) -> tuple[Evidence, IntArray]:
    """Bring evidence to a uniform frame rate, with left and right in order (`sides`).

    The frame interval is the median of the intervals. Where every frame lies within a quarter of an interval
    of a grid of that rate, counted from the first frame, it is refined so that the grid also meets the last
    frame. Frames within 1e-3 of an interval of the grid are kept as they are; others are interpolated
    linearly. Nothing is interpolated across a dropped frame or an unseen landmark: there
    the grid holds NaN with score 0, as it does where landmarks were not seen. Only the camera's path is, its
    centre linearly.

    Args:
        evidence: with T frames at increasing times.

    Returns:
        The evidence with G frames at uniform times, and (T,) the nearest grid index of each original frame.

    Raises:
        InputError: the camera's path is not one transform for each frame, or there are too many frames.
    """
    _check_path(evidence)
    evidence = sides.in_order(evidence)  # before anything is interpolated between two sides
    interval = frame_interval_s(evidence.times_s)
    position = (evidence.times_s - evidence.times_s[0]) / interval  # (T,)
    count = int(np.floor(position[-1] + TAKE_OVER_MAX)) + 1
    most = min(FRAMES_MAX, GAPS_MAX + GAPS_SHARE * len(evidence.times_s))
    if count > most:
        found = f"{count} frames with those that are missing, {interval:.4g} s apart"
        valid = f"at most {most}: a part by --from and --to, or fewer by --every"
        raise InputError(f"times_s: found {found}; valid: {valid}")
    grid_s = evidence.times_s[0] + interval * np.arange(count)
    near = _neighbours(position, count)
    points, scores = evidence.keypoints_px, evidence.scores[..., None]
    seen = ~np.isnan(points).any(-1, keepdims=True)  # (T, J, 1)
    on_grid = replace(
        evidence,
        times_s=grid_s,
        keypoints_px=_lerp(points, near),
        scores=np.nan_to_num(_lerp(np.where(seen, scores, np.nan), near))[..., 0],
        joints_m=_lerp(evidence.joints_m, near),
        camera=None
        if evidence.camera is None
        else cameras.resampled(evidence.camera, evidence.times_s, grid_s),
    )
    return on_grid, np.clip(np.rint(position), 0, count - 1).astype(np.int64)


def _check_path(evidence: Evidence) -> None:
    path = None if evidence.camera is None else evidence.camera.path
    if path is None:
        return
    shape, frames = np.shape(path), len(evidence.times_s)
    if shape[1:] == (4, 4) and shape[0] and (path == path[:1]).all():
        return
    if shape != (frames, 4, 4):
        valid = f"({frames}, 4, 4), a transform for each frame"
        raise InputError(f"the camera's path: found an array of shape {shape}; valid: {valid}")


def frame_interval_s(times_s: Array) -> float:
    """The uniform interval that `resample` uses for frames at increasing times (T,)."""
    intervals = np.diff(times_s)
    median = float(np.median(intervals))
    index = np.concatenate(([0.0], np.cumsum(np.rint(intervals / median))))  # (T,)
    if index[-1] < 1:
        return median
    refined = float((times_s[-1] - times_s[0]) / index[-1])
    error = np.abs((times_s - times_s[0]) / refined - index)
    return refined if error.max() < CLOCK_ERROR_MAX and (np.diff(index) >= 1).all() else median


def visibility(evidence: Evidence, min_score: float = 0.3, min_share: float = 0.25) -> NDArray[np.bool_]:
    """The frames in which the person is in view.

    Args:
        evidence: with T frames.
        min_score: 2D landmarks count from this score on.
        min_share: share of the 2D landmarks that must count.

    Returns:
        (T,) True with enough 2D landmarks, or with any known 3D joint.
    """
    in_view = np.isfinite(evidence.joints_m).all(-1).any(-1)  # (T,)
    if evidence.keypoint_names:
        confident = np.isfinite(evidence.keypoints_px).all(-1) & (evidence.scores >= min_score)  # (T, J)
        in_view = in_view | (confident.mean(-1) >= min_share)
    return np.asarray(in_view)


def _neighbours(position: Array, count: int) -> _Neighbours:
    """Neighbours of the grid points 0 … count - 1 among frames at increasing `position` (T,)."""
    grid = np.arange(count)
    before = np.clip(np.searchsorted(position, grid, side="right") - 1, 0, len(position) - 2)
    since, until = grid - position[before], position[before + 1] - grid  # (G,)
    fraction = np.clip(since / (since + until), 0.0, 1.0)
    fraction[np.abs(since) <= JITTER_MAX] = 0.0
    fraction[np.abs(until) <= JITTER_MAX] = 1.0
    return _Neighbours(
        before=before,
        after=before + 1,
        fraction=fraction,
        adjacent=since + until < GAP_MIN,
        near_before=np.abs(since) <= TAKE_OVER_MAX,
        near_after=np.abs(until) <= TAKE_OVER_MAX,
    )


def _choose(a: Array, b: Array, blended: Array, near: _Neighbours) -> Array:
    """`blended` between adjacent seen frames, else a near seen frame, else NaN; all (G, M, D)."""
    seen_a, seen_b = (~np.isnan(x).any(-1, keepdims=True) for x in (a, b))  # (G, M, 1)
    both = seen_a & seen_b & near.adjacent[:, None, None]
    only_a = seen_a & near.near_before[:, None, None]
    only_b = seen_b & near.near_after[:, None, None]
    return np.where(both, blended, np.where(only_a, a, np.where(only_b, b, np.nan)))


def _lerp(values: Array, near: _Neighbours) -> Array:
    """(T, M, D) → (G, M, D)."""
    a, b, f = values[near.before], values[near.after], near.fraction[:, None, None]
    return _choose(a, b, np.where(f == 0, a, np.where(f == 1, b, (1 - f) * a + f * b)), near)
