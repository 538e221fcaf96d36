"""What contact networks are trained on: motions, virtual videos, and the inputs of the paper's network."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon import kinematics
from simrecon.body import names
from simrecon.contact.features import POINTS
from simrecon.contact.parts import names as part_names
from simrecon.io import toml
from simrecon.kinematics.touched import touched
from simrecon.types import Scene
from tests.support import people
from tools.train import contact_grounded, contact_motions, contact_paper, contact_views
from tools.train.contact_motions import ContactMotion

FRAMES = 91


@pytest.fixture(scope="module")
def motion() -> ContactMotion:
    at = people.walking(FRAMES, speed_mps=1.0)
    points = np.stack([at[point["name"]] for point in names.points()], axis=1)
    return ContactMotion("walk", points, np.full((FRAMES, 11), 0.5), np.zeros((FRAMES, 11)))


def test_no_motion_is_in_two_parts_of_the_split() -> None:
    split = toml.load(contact_motions.SPLIT)
    assert not set(split["test"]) & set(split["validation"])
    assert contact_motions.part_of("deepmimic_roll") == "test"
    assert contact_motions.part_of("cmu_87_01") == "validation"
    assert contact_motions.part_of("cmu_07_01") == "train"
    assert contact_motions.part_of("grounded_validation_02") == "validation"


def test_feet_touch_where_they_are_low_and_slow() -> None:
    points = np.zeros((60, len(names.points()), 3))
    heel = names.resolve(["left_heel"])[0]
    points[20:40, heel, 2] = 0.2
    points[45:, heel, 0] = np.arange(15) * 0.03  # 0.9 m/s along the floor
    touches = ContactMotion("a", points, np.full((60, 11), 0.5), np.zeros((60, 11))).touches
    assert touches[:20, 0].all()
    assert not touches[20:40, 0].any()
    assert not touches[46:, 0].any()
    assert not touches[:, 4:].any()


def test_where_forces_are_known_what_is_pushed_touches(motion: ContactMotion) -> None:
    pushed = np.zeros((FRAMES, 11), bool)
    pushed[10:20, 4] = True
    np.testing.assert_array_equal(replace(motion, pushed=pushed).touches, pushed)
    assert motion.touches[:, :4].any()


def test_a_posture_touches_with_its_parts_alone() -> None:
    rng = np.random.default_rng(0)
    body, kneeling = contact_grounded._person(rng), contact_grounded.POSTURES["kneel"]
    angles = contact_grounded._solved(body, kneeling, 0.0, rng)
    qpos = contact_grounded._configurations(body, np.repeat(angles[None], 2, axis=0))
    clearance = touched(body, Scene(), qpos, np.array([0.0, 1.0])).clearance_m[0]
    own = [part_names().index(part) for part in kneeling.touch]
    above = clearance - clearance.min()
    assert above[own].max() < 0.01
    assert np.delete(above, own).min() > 0.1


def test_a_course_holds_what_touches_before_and_after() -> None:
    rng = np.random.default_rng(1)
    body = contact_grounded._person(rng)
    stand, stoop = (contact_grounded.POSTURES[name] for name in ("stand", "stoop"))
    found = [(posture, contact_grounded._start(posture, rng)) for posture in (stand, stoop)]
    qpos = contact_grounded._course(body, found, rng)
    times = np.arange(len(qpos)) / contact_grounded.RATE_HZ
    np.testing.assert_allclose(touched(body, Scene(), qpos, times).clearance_m.min(axis=1), 0.0, atol=1e-6)
    points = kinematics.configurations(body, qpos)[1]
    at = contact_grounded._anchor(body, points, stand.touch).mean(axis=1)
    np.testing.assert_allclose(at, at[0], atol=1e-9)
    assert np.ptp(points[:, body.skeleton.point_names.index("nose"), 2]) > 0.2


@pytest.mark.parametrize("rate_hz", [24.0, 50.0])
def test_a_view_is_two_seconds_of_a_motion_in_an_image(motion: ContactMotion, rate_hz: float) -> None:
    rng = np.random.default_rng(0)
    for _ in range(5):
        view = contact_views.view(motion, rate_hz, rng, solid=1.0)
        assert len(view.image) == pytest.approx(2 * rate_hz, abs=2)
        assert view.image.shape == (len(view.scores), len(POINTS), 2)
        assert np.median(np.abs(view.image - contact_views.CENTRE_PX)) < 400
        assert view.touches.shape == (len(view.image), 11)
        assert np.isfinite(view.joints_m).all()
    assert np.isnan(contact_views.view(motion, rate_hz, rng, solid=0.0).joints_m).all()


def test_noise_that_lasts_does_not_depend_on_the_frame_rate() -> None:
    for rate in (25.0, 60.0):
        noise = contact_views.lasting((20_000, 1), 2.0, 0.2, rate, np.random.default_rng(1))
        assert noise.std() == pytest.approx(2.0, rel=0.1)
        lag = int(0.2 * rate)
        assert np.corrcoef(noise[lag:, 0], noise[:-lag, 0])[0, 1] == pytest.approx(np.exp(-1), abs=0.06)


def test_the_inputs_of_the_paper_are_351_and_count_from_the_pelvis(motion: ContactMotion) -> None:
    view = contact_views.view(motion, 30.0, np.random.default_rng(0))
    made = contact_paper.windows(view.image, view.scores, contact_paper.LOWER)
    assert made.shape == (len(view.image), 351)
    middle = made.reshape(-1, 9, 13, 3)[:, 4]
    np.testing.assert_allclose(middle[:, 0, :2], 0.0, atol=1e-6)
    assert np.abs(middle[..., :2]).max() < 3
    assert contact_paper.places(contact_paper.LOWER).sum() == 2 * 9 * 13
    assert {len(set(own)) for own in contact_paper.SETS.values()} == {10, 12, 8, 13}


def test_the_majority_of_overlapping_windows_decides() -> None:
    truth = np.zeros((12, 4), bool)
    truth[4:9, 0] = True
    labels = contact_paper.window_labels(truth)
    scores = np.where(labels, 1.0, -1.0)
    np.testing.assert_array_equal(contact_paper.votes(scores), truth)
    scores[6] = -1.0  # one window of five that is wrong is outvoted
    np.testing.assert_array_equal(contact_paper.votes(scores), truth)


def test_the_best_threshold_parts_slow_from_fast() -> None:
    speed = np.concatenate((np.linspace(0, 1, 50), np.linspace(2, 3, 50)))[:, None]
    limit = contact_paper.best_threshold(speed, speed < 1.5)
    assert 1.0 < limit <= 2.05
