"""What the synthesis is trained on: split, views, windows, and that training learns."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simrecon import kinematics
from simrecon.errors import InputError
from simrecon.io import atomic
from simrecon.synthesis.features import CONTEXT, COUNT, FUTURE, POINTS
from simrecon.types import Ground, KinematicFit, Scene
from tests.support.runs import person, squat
from tools.study import synthesis_scores, synthesis_simulated
from tools.train import synthesis_corpus, synthesis_data, synthesis_views
from tools.train.synthesis_corpus import Clip

FRAMES = 100


@pytest.fixture(scope="module")
def fit() -> KinematicFit:
    body = person()
    qpos = squat(body, 0.4 * np.sin(np.linspace(0.0, 6.0, FRAMES)) ** 2)
    qpos[:, 0] += np.linspace(0.0, 2.0, FRAMES)
    return KinematicFit(
        body=body, scene=Scene(), camera=None, times_s=np.arange(FRAMES) / 30, qpos=qpos,
        com_m=kinematics.configurations(body, qpos)[0], reprojection_px=np.empty((FRAMES, 0)),
        interpolated=np.zeros(FRAMES, bool), iterations=0, loss={},
    )  # fmt: skip


@pytest.fixture(scope="module")
def clip(fit: KinematicFit) -> Clip:
    marks = kinematics.configurations(fit.body, fit.qpos)[1]
    simulated = np.ones(FRAMES, bool)
    simulated[40:45] = False
    return Clip("a", fit.times_s, fit.body.skeleton.point_names, marks, marks + 0.01, marks - 0.01, simulated)


def test_no_motion_is_in_two_parts_of_the_split(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    split = synthesis_corpus.split()
    assert not set(split.train) & set(split.test)
    assert len(set(split.names)) == len(split.names) == 69
    (tmp_path / "split.toml").write_text('train = ["a", "b"]\ntest = ["b"]\n', encoding="utf-8")
    monkeypatch.setattr(synthesis_corpus, "SPLIT", tmp_path / "split.toml")
    with pytest.raises(InputError, match="found b more than once; valid: each motion in one part"):
        synthesis_corpus.split.__wrapped__()


def test_a_view_errs_as_networks_do(fit: KinematicFit) -> None:
    seen = synthesis_views.seen(fit, np.random.default_rng(0))
    again = synthesis_views.seen(fit, np.random.default_rng(0))
    np.testing.assert_array_equal(seen.joints_m, again.joints_m)
    marks = synthesis_views.marks_of(fit, fit.qpos)
    error_mm = 1e3 * np.linalg.norm(seen.joints_m - marks, axis=-1).mean()
    assert 50 < error_mm < 400
    inside = (seen.keypoints_px > 0) & (seen.keypoints_px < synthesis_views.SIZE_PX)
    assert inside[..., 0].mean() > 0.99
    assert (seen.height_m, seen.mass_kg) == (fit.body.height_m, fit.body.mass_kg)


def test_a_floor_is_moved_to_zero(fit: KinematicFit) -> None:
    up = fit.qpos.copy()
    up[:, 2] += 0.3
    high = replace(fit, qpos=up, scene=Scene(ground=Ground(height_m=0.3)))
    moved = synthesis_views.on_floor(high)
    assert moved.scene.ground.height_m == 0.0
    np.testing.assert_allclose(moved.qpos, fit.qpos)


def test_windows_are_of_frames_that_were_simulated(clip: Clip) -> None:
    assert list(synthesis_data.runs(clip)) == [slice(0, 40), slice(45, 100)]
    data = synthesis_data.windows([clip], "truth", {"a": 1.75})
    count = 2 * ((40 - 29) + (55 - 29))
    assert data.context.shape == (count, CONTEXT, COUNT)
    assert data.future.shape == (count, FUTURE, COUNT)
    assert data.there.sum(axis=1).min() == synthesis_data.SHORTEST
    far = replace(clip, simulation=clip.simulation + 0.5)
    assert list(synthesis_data.runs(far)) == []


def test_a_mirror_image_changes_sides_twice(clip: Clip) -> None:
    joints = clip.truth[:, synthesis_data.rows_of(clip)]
    other = synthesis_data.mirrored(joints)
    left, right = POINTS.index("left_knee"), POINTS.index("right_knee")
    np.testing.assert_allclose(other[:, left], joints[:, right] * [1, -1, 1])
    np.testing.assert_allclose(synthesis_data.mirrored(other), joints)


def test_tests_are_whole_and_of_the_truth(clip: Clip) -> None:
    found = synthesis_data.tests([clip], {"a": 1.75})
    assert len(found) == 6
    assert {len(test.joints_m) for test in found} == {CONTEXT + FUTURE}
    held = synthesis_scores.score(synthesis_scores.still, found)
    assert (held["apd"] == 0).all()
    assert (held["ade"] > 0).all()
    assert (held["penetration"] == 0).all()


def test_clips_are_read_as_they_are_written(clip: Clip, tmp_path: Path) -> None:
    (tmp_path / "clips").mkdir()
    with pytest.raises(InputError, match="holds no clips"):
        synthesis_data.clips(tmp_path, ["a"])
    atomic.write_npz(tmp_path / "clips" / "a.npz", synthesis_corpus._content(clip))
    (read,) = synthesis_data.clips(tmp_path, ["a", "b"])
    np.testing.assert_array_equal(read.fit, clip.fit)
    figures = synthesis_corpus.figures(read)
    np.testing.assert_allclose(figures["fit_mpjpe_g_mm"], 10 * np.sqrt(3), rtol=1e-6)
    np.testing.assert_allclose(figures["simulation_mpjpe_mm"], 0.0, atol=1e-6)


def test_looks_count_what_is_wrong_with_feet() -> None:
    still = np.zeros((1, FUTURE, len(POINTS), 3))
    assert synthesis_scores.looks(still) == (0.0, 0.0, 0.0)
    sliding = still + np.linspace(0, 2, FUTURE)[:, None, None] * [1.0, 0.0, 0.0]
    assert synthesis_scores.looks(sliding) == (100.0, 0.0, 0.0)
    assert synthesis_scores.looks(still + np.array([0.0, 0.0, 0.1])) == (0.0, 0.0, 100.0)
    assert synthesis_scores.looks(still - np.array([0.0, 0.0, 0.1])) == (0.0, 100.0, 0.0)


def test_the_nearest_is_nearest(rng: np.random.Generator) -> None:
    known = rng.standard_normal((5, 4, len(POINTS), 3))
    near = known[[2]] + 7.0  # the root is not looked at
    flat = synthesis_scores.flat
    np.testing.assert_allclose(synthesis_scores.nearest_m(flat(near), flat(known)), 0.0, atol=1e-6)


def test_how_far_a_place_is_outside_of_points() -> None:
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    for place, far in (([0.5, 0.5], 0.0), ([2.0, 0.5], 1.0), ([-3.0, -4.0], 5.0)):
        np.testing.assert_allclose(synthesis_simulated.outside_m(np.array(place), square), far, atol=1e-3)


def test_training_learns_and_repeats_itself(clip: Clip) -> None:
    pytest.importorskip("torch", reason="PyTorch is not installed (extra train)")
    from tools.train import synthesis_training

    settings = synthesis_training.Settings(steps=40, batch=16, sampling_steps=4, sampling_batch=4)
    data = synthesis_data.windows([clip], "truth", {"a": 1.75})
    lines: list[str] = []
    one = synthesis_training.train(data, 0, settings, lines.append).network()
    two = synthesis_training.train(data, 0, settings).network()
    np.testing.assert_array_equal(one.out.weight, two.out.weight)
    np.testing.assert_array_equal(one.centres.weight, two.centres.weight)
    tests = synthesis_data.tests([clip], {"a": 1.75})
    before = synthesis_training.train(data, 0, replace(settings, steps=1, sampling_steps=1)).network()
    after, start = (
        synthesis_scores.score(synthesis_scores.plain(net, 0), tests)["ade"].mean() for net in (one, before)
    )
    assert after < start
    assert lines[0].startswith("vae 0")
