"""Touch within 2 cm, at rest or moving."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon.metrics import touch
from simrecon.metrics.bones import bone_clearance, bones
from simrecon.metrics.definitions import DEFINITIONS
from simrecon.types import Scene

CAPSULES = ("pelvis", "trunk", "left_forearm", "left_heel", "left_toe")


def test_a_part_touches_with_any_of_its_capsules() -> None:
    clearance = np.array([[0.3, 0.019, 0.5, 0.5, -0.1], [0.3, 0.021, 0.0, 0.5, 0.03]])
    near = touch.near(clearance, CAPSULES)
    names = list(touch.PARTS)
    assert [names[k] for k in np.flatnonzero(near[0])] == ["back", "left_foot"]
    assert [names[k] for k in np.flatnonzero(near[1])] == ["left_arm"]


def test_f1_counts_parts_that_the_reference_touches_with() -> None:
    """The back for four frames, touched in three of them and one beside; a foot for two, which is too few."""
    truth, touches = np.zeros((2, 8, len(touch.PARTS)), bool)
    back, foot = list(touch.PARTS).index("back"), list(touch.PARTS).index("left_foot")
    truth[2:6, back], touches[3:7, back] = True, True
    truth[:2, foot] = True
    scores = touch.scores(touches, truth)
    assert scores == pytest.approx({"touch_f1": 0.75, "touch_f1_least": 0.75, "touch_f1_back": 0.75})
    assert touch.scores(touches, np.zeros_like(truth)) == {}
    assert set(scores) <= set(DEFINITIONS)


def test_every_part_has_a_definition() -> None:
    for prefix in ("touch_f1", "touch_f1_force"):
        assert {prefix, f"{prefix}_least", *(f"{prefix}_{name}" for name in touch.PARTS)} <= set(DEFINITIONS)


def test_who_lies_on_the_back_touches_with_the_back() -> None:
    """The template, its pelvis on the floor."""
    person = bodies.build(bodies.scaled({}, 1.75), height_m=1.75, mass_kg=70.0, sole_m=0.0)
    skeleton = person.skeleton
    upright = bodies.t_pose_m(skeleton)[skeleton.point_segments] + skeleton.point_offsets_m  # (M, 3)
    lying = upright[:, [2, 1, 0]] * [-1.0, 1.0, 1.0]  # the front up
    behind = [
        part.size_m[0] - min(place[0] for place in part.points_m)
        for part in person.primitives
        if part.segment == "pelvis"
    ]
    hip = skeleton.point_names.index("left_hip")
    joints = np.tile(lying + np.array([0.0, 0.0, max(behind) - lying[hip, 2]]), (5, 1, 1))
    radii = {part.name: float(part.size_m[0]) for part in person.primitives if part.kind == "capsule"}
    capsules = bones(skeleton.point_names, joints, Scene(), radii)
    clearance = bone_clearance(capsules, skeleton.point_names, joints, Scene())
    back = list(touch.PARTS).index("back")
    assert touch.near(clearance, capsules.names)[:, back].all()
    prone = joints * [1.0, -1.0, -1.0] + [0.0, 0.0, 2 * joints[0, hip, 2]]
    thinner = bone_clearance(capsules, skeleton.point_names, prone, Scene())[:, 0] - clearance[:, 0]
    assert (thinner > 0.03).all()  # in front of the hips the pelvis is thinner than behind them
