from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simrecon.errors import InputError
from simrecon.evidence import resample, visibility
from simrecon.evidence.resample import frame_interval_s
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.types import Array, Camera, Evidence, Lens


def moving(times_s: Array) -> Evidence:
    """Two landmarks and one joint on straight lines, and one joint turning at 1 rad/s about x."""
    times_s = np.asarray(times_s, float)
    line = np.stack((100 + 50 * times_s, 300 - 20 * times_s), axis=-1)  # (T, 2)
    return Evidence(
        times_s=times_s,
        keypoint_names=("nose", "neck"),
        keypoints_px=np.stack((line, line + 7), axis=1),
        scores=np.full((len(times_s), 2), 0.8),
        joint_names=("pelvis",),
        joints_m=np.stack((times_s, 2 * times_s, 1 - times_s), axis=-1)[:, None],
        joints_frame="world",
    )


def assert_on_the_lines(evidence: Evidence, seen: npt.NDArray[np.bool_]) -> None:
    """As `moving` where `seen` (G,), and nothing elsewhere; 1e-3 intervals of snapping are allowed."""
    want = moving(evidence.times_s)
    np.testing.assert_allclose(evidence.keypoints_px[seen], want.keypoints_px[seen], rtol=0, atol=2e-3)
    np.testing.assert_allclose(evidence.joints_m[seen], want.joints_m[seen], rtol=0, atol=1e-4)
    np.testing.assert_allclose(evidence.scores[seen], 0.8)
    for values in (evidence.keypoints_px, evidence.joints_m):
        assert np.isnan(values[~seen]).all()
    assert not evidence.scores[~seen].any()


@given(st.integers(2, 60), st.floats(5, 240), st.floats(-5, 5), st.floats(0, 4e-4), st.integers(0, 2**31))
def test_constant_rate_only_snaps_the_times(
    count: int, rate: float, start: float, jitter: float, seed: int
) -> None:
    noise = jitter / rate * np.random.default_rng(seed).uniform(-1, 1, count)
    evidence = moving(start + np.arange(count) / rate + noise)
    on_grid, index = resample(evidence)
    assert len(on_grid.times_s) == count
    np.testing.assert_allclose(np.diff(on_grid.times_s), np.diff(on_grid.times_s).mean(), rtol=1e-9)
    np.testing.assert_allclose(on_grid.times_s, evidence.times_s, atol=2e-3 / rate)
    np.testing.assert_array_equal(index, np.arange(count))
    for name in ("keypoints_px", "scores", "joints_m"):
        np.testing.assert_array_equal(getattr(on_grid, name), getattr(evidence, name))


def test_dropped_frames_become_unseen() -> None:
    kept = np.array([0, 1, 2, 5, 6, 7, 9, 10, 11, 12])
    on_grid, index = resample(moving(kept / 30))
    np.testing.assert_array_equal(index, kept)
    np.testing.assert_allclose(on_grid.times_s, np.arange(13) / 30, atol=1e-12)
    assert_on_the_lines(on_grid, np.isin(np.arange(13), kept))


@given(st.integers(0, 2**31))
def test_variable_rate_is_interpolated(seed: int) -> None:
    intervals = np.random.default_rng(seed).uniform(0.8, 1.2, 40) / 30
    evidence = moving(np.concatenate(([0.0], np.cumsum(intervals))))
    on_grid, index = resample(evidence)
    interval = frame_interval_s(evidence.times_s)
    np.testing.assert_allclose(np.diff(on_grid.times_s), interval, rtol=1e-9)
    assert on_grid.times_s[-1] <= evidence.times_s[-1] + 0.1 * interval + 1e-9
    # Half an interval, but for frames after the last grid point.
    errors = np.abs(on_grid.times_s[index] - evidence.times_s) / interval
    assert errors[evidence.times_s <= on_grid.times_s[-1]].max() <= 0.5 + 1e-9
    assert errors.max() <= 0.9 + 1e-9
    inside = on_grid.times_s <= evidence.times_s[-1] + 1e-9
    assert_on_the_lines(
        Evidence(**{**vars(on_grid), **_sliced(on_grid, inside)}), np.ones(inside.sum(), dtype=bool)
    )


def _sliced(evidence: Evidence, frames: npt.NDArray[np.bool_]) -> dict[str, Array]:
    names = ("times_s", "keypoints_px", "scores", "joints_m")
    return {name: getattr(evidence, name)[frames] for name in names}


def test_times_rounded_to_milliseconds_keep_one_grid_point_per_frame() -> None:
    on_grid, index = resample(moving(np.round(np.arange(300) / 30, 3)))
    np.testing.assert_array_equal(index, np.arange(300))
    np.testing.assert_allclose(on_grid.times_s, np.arange(300) / 30, atol=6e-4)
    assert_on_the_lines(on_grid, np.ones(300, dtype=bool))


def test_unseen_landmarks_are_not_interpolated() -> None:
    evidence = moving(np.array([0.0, 1.3, 2.0, 3.0, 4.0, 5.0]) / 30)
    evidence.keypoints_px[1, 0] = np.nan
    evidence.keypoints_px[3, 0] = np.nan
    on_grid, _ = resample(evidence)
    unseen = np.asarray(np.isnan(on_grid.keypoints_px).any(-1))
    np.testing.assert_array_equal(unseen[:, 0], [False, True, False, True, False, False])
    assert not unseen[:, 1].any()
    np.testing.assert_array_equal(on_grid.scores[:, 0] == 0, unseen[:, 0])
    np.testing.assert_allclose(on_grid.keypoints_px[1, 1], moving(np.array([1 / 30])).keypoints_px[0, 1])


def test_no_3d() -> None:
    evidence = replace(moving(np.arange(5) / 30), joint_names=(), joints_m=np.empty((5, 0, 3)))
    on_grid, _ = resample(evidence)
    assert on_grid.joints_m.shape == (5, 0, 3)


def test_the_given_evidence_is_not_changed() -> None:
    evidence = moving(np.array([0, 1, 3, 4]) / 30)
    before = evidence.keypoints_px.copy()
    on_grid, _ = resample(evidence)
    on_grid.keypoints_px[:] = 0
    np.testing.assert_array_equal(evidence.keypoints_px, before)


def carried(times_s: Array) -> Camera:
    """A camera that turns at 0.4 rad/s about an oblique axis while its centre moves on a line."""
    path = np.tile(np.eye(4), (len(times_s), 1, 1))
    path[:, :3, :3] = rotations.matrix(rotations.exp(0.4 * times_s[:, None] * [0.6, 0.0, 0.8]))
    centre = np.stack((1 + times_s, -2 * times_s, 3 + 0 * times_s), axis=-1)
    path[:, :3, 3] = -(path[:, :3, :3] @ centre[..., None])[..., 0]
    return Camera(Lens(np.eye(3), np.zeros(5), (640, 480)), path)


def test_a_moving_camera_is_interpolated() -> None:
    times_s = np.array([0.0, 1.3, 2.0, 3.0, 7.0, 7.7, 9.0, 10.0]) / 30
    on_grid, _ = resample(replace(moving(times_s), camera=carried(times_s)))
    expected = carried(on_grid.times_s).path
    assert expected is not None
    assert on_grid.camera is not None
    assert on_grid.camera.path is not None
    np.testing.assert_allclose(on_grid.camera.path, expected, atol=1e-12)


def test_a_still_camera_stays_where_it_is() -> None:
    times_s = np.array([0.0, 1.3, 2.0, 3.0, 7.0]) / 30
    path = carried(times_s).path
    assert path is not None
    where = path[3]
    camera = cameras.still(carried(times_s).lens, where, len(times_s))
    on_grid, _ = resample(replace(moving(times_s), camera=camera))
    assert on_grid.camera is not None
    np.testing.assert_array_equal(on_grid.camera.path, np.tile(where, (len(on_grid.times_s), 1, 1)))


def test_visibility() -> None:
    evidence = replace(moving(np.arange(5) / 30), joints_m=np.full((5, 1, 3), np.nan))
    evidence.keypoints_px[1] = np.nan  # not seen
    evidence.scores[2] = 0.1  # seen without confidence
    evidence.scores[3] = [0.9, 0.0]  # one landmark of two
    np.testing.assert_array_equal(visibility(evidence), [True, False, False, True, True])
    np.testing.assert_array_equal(visibility(evidence, min_share=0.6), [True, False, False, False, True])
    np.testing.assert_array_equal(visibility(evidence, min_score=0.05), [True, False, True, True, True])
    evidence.joints_m[1] = 0.5
    np.testing.assert_array_equal(visibility(evidence), [True, True, False, True, True])


def test_gaps_do_not_make_frames_without_end() -> None:
    """Frames half a millisecond apart, three at a time, a minute between: twelve million on the grid."""
    times_s = (60.0 * np.arange(100)[:, None] + [0.0, 0.0005, 0.001]).ravel()
    seen = moving(times_s)
    with pytest.raises(
        InputError, match=r"times_s: found 11880003 frames .* 0.0005 s apart; valid: at most 16000"
    ):
        resample(seen)
