"""What names of landmarks mean, and which layout landmarks without names are in."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest

from simrecon import body, evidence
from simrecon.body import names as body_names
from simrecon.errors import InputError
from simrecon.evidence import Options
from simrecon.evidence.keypoints import anatomy, layouts
from simrecon.types import Camera, Lens
from tests.support import foreign_files as foreign
from tests.support import people

LENS = Camera(Lens(np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]]), np.zeros(5), (640, 480)))
ASKED = Options(fps=30.0, camera=LENS)
BODY = [name for name in layouts.all_names() if len(layouts.layout(name)) < 34]


def of_equal_size(name: str) -> tuple[str, ...]:
    return tuple(one for one in BODY if len(layouts.layout(one)) == len(layouts.layout(name)))


@pytest.mark.parametrize(("name", "yaw"), list(product(BODY, (0.0, 0.8, 1.6, 2.6, 4.0))))
def test_a_layout_is_known_by_the_proportions_from_every_side(name: str, yaw: float) -> None:
    points = people.seen(people.named(people.walking(), layouts.layout(name)), yaw_rad=yaw)
    strains = {one: anatomy.strain(points, layouts.layout(one)) for one in of_equal_size(name)}
    own = strains.pop(name)
    assert own is not None
    assert own[0] < 0.15
    assert own[1] < 0.02
    others = [one for one in strains.values() if one is not None]
    assert all(one[0] > own[0] + 0.04 or one[1] > own[1] + 0.03 for one in others)


@pytest.mark.parametrize("name", [name for name in BODY if len(of_equal_size(name)) > 1])
@pytest.mark.parametrize("tilt", [0.0, 1.57, 3.1])  # upright, lying, on the head
def test_landmarks_of_a_number_that_several_layouts_have_are_read_in_theirs(
    tmp_path: Path, name: str, tilt: float
) -> None:
    points = people.landmarks(layouts.layout(name)) - [320, 250]
    turn = np.array([[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]])
    points = points @ turn.T + [320, 240] + np.random.default_rng(0).normal(0, 1.5, points.shape)
    np.save(tmp_path / "clip.npy", np.concatenate((points, np.ones((*points.shape[:2], 1))), axis=-1))
    found = evidence.read(tmp_path / "clip.npy", ASKED)
    assert found.keypoint_names == tuple(one for one in layouts.layout(name) if one)
    assert f"in the order of {name}" in found.reading


def test_landmarks_in_no_known_order_are_refused_and_the_user_can_say_it(tmp_path: Path) -> None:
    points = people.landmarks(layouts.layout("openpose_25"))
    mixed = points[:, np.random.default_rng(3).permutation(25)]
    np.save(tmp_path / "clip.npy", np.concatenate((mixed, np.ones((30, 25, 1))), axis=-1))
    with pytest.raises(
        InputError, match=r"no person in the order of .*; valid: --layout openpose_25, "
    ) as raised:
        evidence.read(tmp_path / "clip.npy", ASKED)
    assert "\n" not in str(raised.value)
    asked = Options(fps=30.0, camera=LENS, layout="openpose_25b")
    assert "openpose_25b as given" in evidence.read(tmp_path / "clip.npy", asked).reading
    asked = Options(fps=30.0, camera=LENS, layout="coco_17")
    with pytest.raises(InputError, match="--layout: found coco_17 for 25 landmarks; valid: openpose_25, "):
        evidence.read(tmp_path / "clip.npy", asked)


def test_too_little_of_a_person_to_tell_is_asked_for(tmp_path: Path) -> None:
    points = people.landmarks(layouts.layout("coco_17"))
    points[:, 5:] = np.nan
    points[:, 2:5] = np.nan
    np.save(tmp_path / "clip.npy", np.concatenate((points, np.ones((30, 17, 1))), axis=-1))
    with pytest.raises(InputError, match="could be in more than one order; valid: --layout coco_17, h36m_17"):
        evidence.read(tmp_path / "clip.npy", ASKED)


def test_a_close_up_is_read(tmp_path: Path) -> None:
    points = people.landmarks(layouts.layout("openpose_25"))
    points[
        :,
        [i for i, name in enumerate(layouts.layout("openpose_25")) if "hip" in name or i > 18 or 9 < i < 15],
    ] = np.nan
    np.save(tmp_path / "clip.npy", np.concatenate((points, np.ones((30, 25, 1))), axis=-1))
    assert "in the order of openpose_25," in evidence.read(tmp_path / "clip.npy", ASKED).reading


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        # Halpe and RTMPose: the head is the crown, the hip without a side the middle
        ("head neck hip left_big_toe left_small_toe left_heel", "head_top neck pelvis left_toe - left_heel"),
        # Human3.6M of MMPose
        (
            "root right_hip right_foot left_knee spine thorax neck_base head left_wrist",
            "pelvis right_hip right_ankle left_knee chest neck - head_top left_wrist",
        ),
        ("right_foot right_ankle left_hand left_wrist", "right_foot right_ankle left_hand left_wrist"),
        # MPII
        ("pelvis thorax upper_neck head_top r_ankle", "pelvis neck skull_base head_top right_ankle"),
        # as people spell them
        ("LShoulder RBigToe L.Hip knee_r", "left_shoulder right_toe left_hip right_knee"),
        ("Left-Wrist rightElbow relbow", "left_wrist right_elbow -"),
        ("left_forefinger1 left_pinky_finger1 mid_hip nose tail", "left_index left_pinky pelvis nose -"),
        ("head head_top", "head head_top"),
        (
            "ankle1 knee1 hip1 hip2 knee2 ankle2 wrist1 elbow1 shoulder1 shoulder2 elbow2 wrist2 chin "
            "forehead",
            "right_ankle right_knee right_hip left_hip left_knee left_ankle right_wrist right_elbow "
            "right_shoulder left_shoulder left_elbow left_wrist skull_base head_top",
        ),
    ],
)  # fmt: skip
def test_names_mean_points_of_the_body(given: str, meant: str) -> None:
    assert layouts.known(given.split()) == tuple(name.replace("-", "") for name in meant.split())


@pytest.mark.parametrize("name", layouts.all_names())
def test_small_toes_do_not_shorten_the_foot(name: str) -> None:
    at = people.walking(1)
    listed = [one for one in layouts.layout(name) if one]
    points = [body_names.points()[k]["name"] for k in body_names.resolve(listed) if k != body_names.IGNORED]
    if "left_toe" in points:
        assert points.count("left_toe") == 1
        assert np.linalg.norm(at["left_toe"] - at["left_heel"]) == pytest.approx(
            0.14 * people.STATURE_M, rel=0.01
        )


@pytest.mark.parametrize(
    "name", ["h36m_17", "mpii_16", "halpe_26", "openpose_25", "openpose_25b", "vitpose_25", "blazepose_33"]
)
def test_the_stature_of_a_person_of_known_height_is_found_in_each_layout(tmp_path: Path, name: str) -> None:
    """Within 2 per cent, from landmarks in space, so that no name is another point than it says."""
    places = people.named(people.walking(60, speed_mps=0.8), layouts.layout(name))
    np.save(tmp_path / "clip.npy", places)
    found = evidence.read(tmp_path / "clip.npy", Options(fps=30.0))
    skeleton = body.scaled(body.measure(found))
    assert body.stature_m(skeleton) == pytest.approx(people.STATURE_M, rel=0.02)


def test_layouts_are_those_that_the_support_files_know() -> None:
    assert set(foreign.USUAL) == {len(layouts.layout(name)) for name in layouts.all_names()}
