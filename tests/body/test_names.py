"""Names of landmarks and joints as other projects write them."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon.body import names

BOTH = ("{}_shoulder", "{}_elbow", "{}_wrist", "{}_hip", "{}_knee", "{}_ankle")
COCO_17 = ("nose", "{}_eye", "{}_ear", *BOTH)
BLAZEPOSE_33 = (
    *("nose", "{}_eye_inner", "{}_eye", "{}_eye_outer", "{}_ear", "mouth_{}", *BOTH),
    *("{}_pinky", "{}_index", "{}_thumb", "{}_heel", "{}_foot_index"),
)
OPENPOSE_25 = (
    *("Nose", "Neck", "MidHip", "{}Eye", "{}Ear", "{}Shoulder", "{}Elbow", "{}Wrist"),
    *("{}Hip", "{}Knee", "{}Ankle", "{}BigToe", "{}SmallToe", "{}Heel"),
)
SMPL_24 = (
    *("pelvis", "spine1", "spine2", "spine3", "neck", "head"),
    *(
        "{}_hip",
        "{}_knee",
        "{}_ankle",
        "{}_foot",
        "{}_collar",
        "{}_shoulder",
        "{}_elbow",
        "{}_wrist",
        "{}_hand",
    ),
)
OPENSIM = (
    *("ground_pelvis", "back", "hip_{}", "knee_{}", "walker_knee_{}", "ankle_{}", "mtp_{}", "calcn_{}"),
    *("toes_{}", "acromial_{}", "elbow_{}", "radius_hand_{}"),
)
NO_FIXED_PLACE = ("mouth", "spine3", "collar", "SmallToe")


def both_sides(name: str, left: str, right: str) -> list[str]:
    return [name.format(left), name.format(right)] if "{}" in name else [name]


@pytest.mark.parametrize(
    ("table", "left", "right", "count"),
    [
        (COCO_17, "left", "right", 17),
        (BLAZEPOSE_33, "left", "right", 33),
        (OPENPOSE_25, "L", "R", 25),
        (SMPL_24, "left", "right", 24),
        (OPENSIM, "l", "r", 22),
    ],
    ids=["coco_17", "blazepose_33", "openpose_25", "smpl_24", "opensim"],
)
def test_every_name_means_a_point_on_its_own_side(
    table: tuple[str, ...], left: str, right: str, count: int
) -> None:
    listed = [name for entry in table for name in both_sides(entry, left, right)]
    assert len(listed) == count
    points = names.points()
    for entry in table:
        rows = names.resolve(both_sides(entry, left, right))
        if any(part in entry for part in NO_FIXED_PLACE):
            assert (rows == names.IGNORED).all()
            continue
        resolved = [points[row]["name"] for row in rows]
        if len(resolved) == 2:
            assert resolved[0].startswith("left_")
            assert resolved[1] == resolved[0].replace("left_", "right_")
        else:
            assert not resolved[0].startswith(("left_", "right_"))


def test_names_mean_what_they_say() -> None:
    known = {
        "left_foot_index": "left_toe",
        "RBigToe": "right_toe",
        "MidHip": "pelvis",
        "calcn_r": "right_heel",
        "spine2": "chest",
        "LElbow": "left_elbow",
        "radius_hand_l": "left_wrist",
        "Right_Knee": "right_knee",
    }
    assert [names.points()[row]["name"] for row in names.resolve(known)] == list(known.values())


def test_the_paper_counts_28_landmarks() -> None:
    assert names.landmark_count() == 28
    listed = [point["name"] for point in names.points()]
    assert len(set(listed)) == len(listed) == 36


def test_unknown_names_are_errors() -> None:
    with pytest.raises(KeyError, match="left_tail"):
        names.resolve(["nose", "left_tail"])
    assert "left_tail" not in names.valid_names()
    assert names.resolve(names.valid_names()).shape == (len(names.valid_names()),)


def test_mirror_images() -> None:
    entry = {
        "name": "left_hip",
        "parent": "pelvis",
        "to_joint": "left_knee",
        "offset": [0.1, 0.2, 0.3],
        "rest_deg": [1, 2, 3],
        "range_deg": [[-1, 2], [-3, 4], [-5, 6]],
        "mass": 4.0,
    }
    left, right = names.mirrored(entry)
    assert left is entry
    assert right == {
        "name": "right_hip",
        "parent": "pelvis",
        "to_joint": "right_knee",
        "offset": [0.1, -0.2, 0.3],
        "rest_deg": [-1, 2, -3],
        "range_deg": [[-2, 1], [-3, 4], [-6, 5]],
        "mass": 4.0,
    }
    assert names.mirrored({"name": "neck"}) == ({"name": "neck"},)
    assert np.array_equal(names.resolve([]), np.empty(0, dtype=np.int64))
